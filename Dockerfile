# SPDX-License-Identifier: Apache-2.0
# Image with the command `libocc` and the Python package, on Debian 12:
#   docker build -t libocc .
#   docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/work" libocc locate picture.png room.yaml
# The first stage builds the wheel with the compiler; the second has the wheel, Python and the shared libraries that the
# wheel loads, and no compiler.
FROM debian:12 AS build
COPY . /libocc
WORKDIR /libocc
RUN tools/set_up
RUN CXX=c++ .venv/bin/pip wheel --no-build-isolation --no-deps --wheel-dir /wheels .
# Names of the packages whose libraries the wheel loads.
RUN .venv/bin/pip install --no-deps --target /unpacked /wheels/*.whl \
  && ldd /unpacked/libocc/*.so | awk '$3 ~ "^/" { print $3 }' | sort -u \
  | while read -r library; do dpkg-query -S "*/${library##*/}"; done | cut -d: -f1 | sort -u >/wheels/packages \
  && cat /wheels/packages

FROM debian:12-slim
COPY --from=build /wheels /wheels
RUN apt-get update -q \
  && xargs apt-get install -q -y --no-install-recommends ca-certificates python3 python3-venv </wheels/packages \
  && python3 -m venv /opt/libocc \
  && /opt/libocc/bin/pip install --no-cache-dir /wheels/*.whl \
  && rm -rf /var/lib/apt/lists/* /wheels \
  && ln -s /opt/libocc/bin/libocc /usr/local/bin/libocc \
  && libocc demo --out /tmp/demo >/dev/null && rm -rf /tmp/demo \
  && useradd --create-home user
USER user
ENV MPLCONFIGDIR=/tmp/matplotlib
WORKDIR /work
ENTRYPOINT ["libocc"]
CMD ["--help"]
