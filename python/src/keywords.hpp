// SPDX-License-Identifier: Apache-2.0
// Python functions whose keywords are known at run time only. pybind11 instantiates its templates
// for each argument of each function; here, a field is an offset and a pointer to the conversions
// of its type, so a list of fields compiles once for each type and not for each function. The
// functions are pybind11's own: it selects overloads, fills in defaults and writes signatures.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/typing.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <typeinfo>
#include <utility>
#include <vector>

namespace occ::python {

namespace py = pybind11;

/// Conversions between Python objects and values of one type, given by their addresses.
struct Conversions {
  const char* text;                    ///< in signatures; each % stands for one of the types
  const std::type_info* const* types;  ///< ends with null
  bool is_enum;
  py::object (*cast)(const void* value, py::return_value_policy policy, py::handle parent);
  bool (*load)(py::handle object, bool convert, void* value);  ///< null: to Python only
};

template <class T>
struct ConversionsOf {
  using Caster = py::detail::make_caster<T>;

  static bool load(py::handle object, bool convert, void* value) {
    Caster caster;
    if (!caster.load(object, convert)) return false;
    *static_cast<T*>(value) = py::detail::cast_op<T&&>(std::move(caster));
    return true;
  }
  static py::object cast(const void* value, py::return_value_policy policy, py::handle parent) {
    return py::reinterpret_steal<py::object>(
        Caster::cast(*static_cast<const T*>(value), policy, parent));
  }

  static constexpr auto name = Caster::name;
  static constexpr auto types = decltype(Caster::name)::types();
  static constexpr Conversions to_python{name.text, types.data(), std::is_enum_v<T>, &cast,
                                         nullptr};
  static constexpr Conversions table{name.text, types.data(), std::is_enum_v<T>, &cast, &load};
};

/// A class by its operations on objects that are given by their addresses.
struct ClassTable {
  using Object = std::unique_ptr<void, void (*)(void*)>;

  const std::type_info* type;
  Object (*make)();
  Object (*copy)(const void* object);
  void (*validate)(void* object);
  py::object (*release)(Object object);  ///< moves the object to Python
};

template <class C, class = void>
struct has_validate : std::false_type {};
template <class C>
struct has_validate<C, std::void_t<decltype(std::declval<C&>().validate())>> : std::true_type {};

template <class C>
struct ClassTableOf {
  using Object = ClassTable::Object;

  static void destroy(void* object) { delete static_cast<C*>(object); }
  static Object make() { return {new C{}, &destroy}; }
  static Object copy(const void* object) {
    return {new C(*static_cast<const C*>(object)), &destroy};
  }
  static void validate([[maybe_unused]] void* object) {
    if constexpr (has_validate<C>::value) static_cast<C*>(object)->validate();
  }
  static py::object release(Object object) {
    return py::cast(static_cast<C*>(object.release()), py::return_value_policy::take_ownership);
  }

  static constexpr ClassTable table{&typeid(C), &make, &copy, &validate, &release};
};

/// One field of a class.
struct Keyword {
  const char* name;
  std::string doc;
  bool is_required;
  std::ptrdiff_t offset;  ///< position of the value in an object [bytes]
  const Conversions* type;

  py::object value_in(const void* object, py::return_value_policy policy,
                      py::handle parent = {}) const {
    return type->cast(static_cast<const char*>(object) + offset, policy, parent);
  }
  bool load(py::handle value, bool convert, void* object) const {
    return type->load(value, convert, static_cast<char*>(object) + offset);
  }
};

/// Distance of a member from the start of its object.
template <class C, class Access>
std::ptrdiff_t offset_of(const Access& access) {
  alignas(C) static char object[sizeof(C)];
  const auto& member = access(*reinterpret_cast<const C*>(object));
  return reinterpret_cast<const char*>(&member) - object;
}

/// Fields of a class, which are keywords of a constructor or of a function.
struct Keywords {
  const ClassTable* owner;
  std::vector<Keyword> list;

  /// Sets the fields of an object from the arguments of a call, beginning with number `first`, and
  /// validates it. Returns false if an argument does not convert.
  bool load(const py::detail::function_call& call, std::size_t first, void* object) const;
};

/// Python's repr of a value, with arrays as nested lists. Adding 0 turns -0 into 0.
std::string object_repr(py::object object, bool is_enum);

template <class T>
std::string value_repr(const T& value) {
  return object_repr(py::cast(value), std::is_enum_v<T>);
}

/// "\n\nTITLE:\n" and "  name: doc\n" for each field, for a docstring.
std::string fields_doc(const Keywords& keywords, const char* title);

/// Defines a documented read-only property for each field.
void define_properties(py::object& cls, const Keywords& keywords);
void define_property(py::object& cls, const std::type_info& type, const Keyword& keyword);

using State = py::typing::Dict<py::str, py::object>;

/// Conversion of the objects of a class to a state that can be pickled, and back.
struct Pickling {
  const std::type_info* type;
  const Conversions* state;  ///< type of the state, for the signatures
  std::function<py::object(const void* object)> get;
  std::function<ClassTable::Object(const py::object& state)> set;
};
void define_pickling(py::object& cls, const Pickling& pickling);

/// Defines the repr "NAME(field=value, ...)" of the fields that differ from their defaults.
void define_repr(py::object& cls, const char* name, const Keywords& keywords);

/// Defines constructor, properties, `replace` and pickling of an immutable value, but no repr.
void define_value(py::object& cls, const Keywords& keywords);

/// A function of pybind11 whose arguments are appended one by one, with `data` for its code.
class Function : public py::cpp_function {
 public:
  using Code = py::handle (*)(py::detail::function_call& call);
  using Types = const std::type_info* const*;

  /// count: number of arguments before the keywords, self included.
  template <class Data>
  Function(Code code, Data data, std::uint16_t count)
      : record_(make_function_record()), count_(count) {
    record_->impl = code;
    record_->data[0] = new Data(std::move(data));
    record_->free_data = [](py::detail::function_record* r) {
      delete static_cast<Data*>(r->data[0]);
    };
    record_->nargs_pos = count;
  }

  /// Annotates the function and its arguments as the constructor of py::cpp_function does.
  template <class... Extra>
  Function& annotated(const Extra&... extra) {
    py::detail::process_attributes<Extra...>::init(extra..., record_.get());
    return *this;
  }

  /// Appends text of the signature, with the types of each %.
  Function& text(const char* text, Types types = nullptr);
  Function& keywords(const Keywords& keywords);
  /// The last argument is a dictionary of further keywords.
  Function& takes_more();
  /// Makes the function, whose text must be complete. initialize_generic() is a protected member of
  /// py::cpp_function (checked with pybind11 3.0 and 3.1).
  void made();

 private:
  unique_function_record record_;
  std::uint16_t count_;
  std::string text_;
  std::vector<const std::type_info*> types_;
  std::deque<std::string> texts_;  ///< default values; made() copies them
};

/// Code of a function with a head of typed arguments and the keywords of an options struct.
template <class Body, class Return, class Options, class... Head>
struct OptionsFunction {
  using Loader = py::detail::argument_loader<Head...>;
  using Void = py::detail::void_type;
  using Result = py::detail::make_caster<std::conditional_t<std::is_void_v<Return>, Void, Return>>;

  Body body;
  Keywords keywords;

  static py::handle call(py::detail::function_call& call) {
    const auto& self = *static_cast<const OptionsFunction*>(call.func.data[0]);
    Loader head;
    if (!head.load_args(call)) return PYBIND11_TRY_NEXT_OVERLOAD;
    Options options{};
    if (!self.keywords.load(call, sizeof...(Head), &options)) return PYBIND11_TRY_NEXT_OVERLOAD;
    const auto body = [&](Head... arguments) -> Return {
      return self.body(std::move(options), std::forward<Head>(arguments)...);
    };
    const auto policy = py::detail::return_value_policy_override<Return>::policy(call.func.policy);
    return Result::cast(std::move(head).template call<Return, Void>(body), policy, call.parent);
  }

  template <class... Extra>
  static Function made(Body body, const Keywords& keywords, const Extra&... extra) {
    static constexpr auto head = Loader::arg_names;
    static constexpr auto head_types = decltype(head)::types();
    static constexpr auto result = Result::name;
    static constexpr auto result_types = decltype(result)::types();
    Function function(&call, OptionsFunction{std::move(body), keywords}, sizeof...(Head));
    function.annotated(extra...).text("(").text(head.text, head_types.data());
    function.keywords(keywords).text(") -> ").text(result.text, result_types.data()).made();
    return function;
  }
};

template <class Body, class Return, class Options, class... Head>
OptionsFunction<Body, Return, Options, Head...> options_function_of(Return (*)(Options, Head...));

/// Returns the function of Python that calls body(options, arguments...).
template <class Body, class... Extra>
Function options_function(const Body& body, const Keywords& keywords, const Extra&... extra) {
  using Called = py::detail::function_signature_t<Body>;
  using Made = decltype(options_function_of<Body>(static_cast<Called*>(nullptr)));
  return Made::made(body, keywords, extra...);
}

}  // namespace occ::python
