# SPDX-License-Identifier: Apache-2.0
"""Turns Doxygen's XML into directives of Sphinx's C++ domain, header by header.

Doxygen parses; this module keeps the order of the headers and shows text and declarations as they are written there.
"""

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Iterator
from pathlib import Path

from plain_text import escape

Node = ElementTree.Element
CLASSES = {"struct", "class", "union"}


def text_of(node: Node | None) -> str:
    """Text of a node without markup, on one line."""
    return "" if node is None else " ".join("".join(node.itertext()).split())


def description(node: Node) -> Iterator[str]:
    """Brief and detailed description as reStructuredText."""
    for name in ("briefdescription", "detaileddescription", "inbodydescription"):
        found = node.find(name)
        for child in () if found is None else found:
            yield from block(child)


def block(node: Node) -> Iterator[str]:
    """One paragraph, list or literal of a description."""
    if node.tag in ("verbatim", "preformatted", "programlisting"):
        lines = [text_of(line) for line in node] if node.tag == "programlisting" else (node.text or "").splitlines()
        yield from ("::", "", *("   " + line for line in lines), "")
        return
    if node.tag in ("itemizedlist", "orderedlist"):
        yield from (f"- {escape(text_of(item))}" for item in node)
        yield ""
        return
    inner = {"verbatim", "preformatted", "programlisting", "itemizedlist", "orderedlist"}
    text = node.text or ""
    for child in node:
        if child.tag in inner:
            yield from (escape(" ".join(text.split())), "", *block(child))
            text = child.tail or ""
        else:
            written = "".join(child.itertext())
            text += (f"`{written}`" if child.tag == "computeroutput" else written) + (child.tail or "")
    if text.strip():
        yield from (escape(" ".join(text.split())), "")


def template(node: Node) -> str:
    """`template <...>` before a declaration, or nothing."""
    parameters = node.find("templateparamlist")
    if parameters is None:
        return ""
    parts = []
    for each in parameters:
        name, default = text_of(each.find("declname")), text_of(each.find("defval"))
        parts.append(text_of(each.find("type")) + (f" {name}" if name else "") + (f" = {default}" if default else ""))
    return f"template <{', '.join(parts)}> "


def cleaned(declaration: str) -> str:
    """Declaration without what belongs to the compiler only."""
    declaration = re.sub(r"\bLIBOCC_API\b|\bfriend\b|\binline\b|\[\[\w+\]\]", "", declaration)
    declaration = re.sub(r"=\s*(default|delete|0)\s*$", r"= \1", declaration)
    return " ".join(re.sub(r"\s+([&*])", r" \1", declaration).split())


def function(node: Node) -> str:
    mark = "static " if node.get("static") == "yes" else ""
    mark += "explicit " if node.get("explicit") == "yes" else ""
    mark += "virtual " if node.get("virt") != "non-virtual" else ""
    kind = text_of(node.find("type"))
    kind = re.sub(r"^(?:static|virtual|explicit)\s+", "", kind)
    return cleaned(f"{template(node)}{mark}{kind} {text_of(node.find('name'))}{text_of(node.find('argsstring'))}")


def variable(node: Node) -> str:
    value = text_of(node.find("initializer"))
    value = f" {value}" if re.fullmatch(r"= ?[\w.+-]+(?:::\w+)*", value) else ""
    mark = "static " if node.get("static") == "yes" else ""
    kind = re.sub(r"^static\s+", "", text_of(node.find("type")))
    return cleaned(f"{mark}{kind} {text_of(node.find('name'))}{text_of(node.find('argsstring'))}{value}")


def member(node: Node, indent: str) -> Iterator[str]:
    """Directive of a function, variable, type or enumeration."""
    kind, name = node.get("kind"), text_of(node.find("name"))
    if name.startswith("@") or node.get("prot") == "private":
        return
    if kind == "function":
        head = f".. cpp:function:: {function(node)}"
    elif kind == "variable":
        head = f".. cpp:var:: {variable(node)}"
    elif kind == "typedef":
        aliased = text_of(node.find("type"))
        head = f".. cpp:type:: {template(node)}{name}" + (f" = {aliased}" if "(" not in aliased else "")
    elif kind == "enum":
        head = f".. cpp:enum{'-class' if node.get('strong') == 'yes' else ''}:: {name}"
    else:
        return
    yield from (indent + head, "")
    yield from (indent + "   " + line if line else "" for line in description(node))
    for value in node.iter("enumvalue"):
        yield from (f"{indent}   .. cpp:enumerator:: {text_of(value.find('name'))}", "")
        yield from (indent + "      " + line if line else "" for line in description(value))


def share_descriptions(nodes: list[Node]) -> None:
    """Gives variables of one declaration (`double x, y;`) the description that one of them has."""
    described = {
        place(node): [part for part in node if part.tag.endswith("description")]
        for node in nodes
        if node.get("kind") == "variable" and any(description(node))
    }
    for node in nodes:
        if node.get("kind") == "variable" and not any(description(node)):
            for empty in [part for part in node if part.tag.endswith("description")]:
                node.remove(empty)
            node.extend(described.get(place(node), []))


def place(node: Node) -> tuple[str, int]:
    """File and line of a declaration."""
    location = node.find("location")
    if location is None:
        return "", 0
    return (
        location.get("declfile") or location.get("file") or "",
        int(location.get("declline") or location.get("line") or 0),
    )


class CppApi:
    """All classes and members of the namespace occ, by header."""

    def __init__(self, xml: Path):
        self._classes: dict[str, Node] = {}
        self._members: dict[str, list[Node]] = {}
        for path in sorted(xml.glob("*.xml")):
            if path.name in ("index.xml", "Doxyfile.xml"):
                continue
            for compound in ElementTree.parse(path).getroot().iter("compounddef"):
                if compound.get("kind") in CLASSES:
                    self._classes[text_of(compound.find("compoundname"))] = compound
                elif compound.get("kind") == "namespace":
                    self._add_members(compound)

    def _add_members(self, namespace: Node) -> None:
        name = text_of(namespace.find("compoundname"))
        if name != "occ" and not name.startswith("occ::") or "internal" in name:
            return
        for node in namespace.iter("memberdef"):
            node.set("scope", name)
            self._members.setdefault(place(node)[0], []).append(node)

    def _class(self, name: str, indent: str) -> Iterator[str]:
        node = self._classes[name]
        short = name.rsplit("::", 1)[-1]
        yield from (
            f"{indent}.. cpp:{'struct' if node.get('kind') == 'struct' else 'class'}:: {template(node)}{short}",
            "",
        )
        inner = indent + "   "
        yield from (inner + line if line else "" for line in description(node))
        nested = [text_of(each) for each in node.iter("innerclass") if each.get("prot") == "public"]
        parts: list[tuple[int, Iterable[str]]] = [
            (place(self._classes[each])[1], self._class(each, inner)) for each in nested if each in self._classes
        ]
        members = [each for each in node.iter("memberdef") if each.get("prot") == "public"]
        share_descriptions(members)
        parts += [(place(each)[1], member(each, inner)) for each in members]
        for _, lines in sorted(parts, key=lambda part: part[0]):
            yield from lines

    def of_header(self, header: str) -> Iterator[str]:
        """Directives of everything that a header declares, in its order."""
        parts: list[tuple[int, str, Iterable[str]]] = []
        for name, node in self._classes.items():
            scope = name.rpartition("::")[0]
            if place(node)[0] == header and scope not in self._classes and "<" not in name and "internal" not in name:
                parts.append((place(node)[1], scope, self._class(name, "")))
        for each in self._members.get(header, ()):
            parts.append((place(each)[1], each.get("scope", "occ"), member(each, "")))
        for _, scope, lines in sorted(parts, key=lambda part: part[0]):
            yield from (f".. cpp:namespace:: {scope}", "", *lines, "")
