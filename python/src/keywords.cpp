// SPDX-License-Identifier: Apache-2.0
#include "keywords.hpp"

#include <pybind11/numpy.h>

#include <algorithm>
#include <cmath>

namespace occ::python {
namespace {

using py::detail::function_call;

using Changes = py::KWArgs<py::object>;

std::string repr_in(const Keyword& keyword, const void* object) {
  return object_repr(keyword.value_in(object, py::return_value_policy::copy),
                     keyword.type->is_enum);
}

/// Text of a default value in a signature.
std::string default_text(const Keyword& keyword, const py::object& value) {
  if (py::isinstance<py::float_>(value) && std::isinf(value.cast<double>())) return "float('inf')";
  return object_repr(value, keyword.type->is_enum);
}

/// Address of the object that a method is called for, or null if it is none of the class.
void* self_of(const function_call& call, const std::type_info& type) {
  py::detail::type_caster_generic self(type);
  if (!self.load(call.args[0], call.args_convert[0])) return nullptr;
  if (!self.value) throw py::reference_cast_error();
  return self.value;
}

/// Gives an object to the Python object that is being constructed.
void construct(const function_call& call, ClassTable::Object object) {
  auto* holder = reinterpret_cast<py::detail::value_and_holder*>(call.args[0].ptr());
  holder->value_ptr() = object.release();
}

/// Sets the fields that `changes` names, and validates the object.
void change(void* object, const py::dict& changes, const Keywords& keywords) {
  std::size_t used = 0;
  for (const Keyword& keyword : keywords.list) {
    if (!changes.contains(keyword.name)) continue;
    ++used;
    const py::object value = changes[keyword.name];
    if (!keyword.load(value, true, object))
      throw py::type_error(std::string(keyword.name) + ": unsuitable value " +
                           py::cast<std::string>(py::repr(value)));
  }
  if (used != changes.size()) {
    for (const auto& item : changes) {
      const auto name = py::cast<std::string>(item.first);
      const bool known = std::any_of(keywords.list.begin(), keywords.list.end(),
                                     [&](const Keyword& keyword) { return name == keyword.name; });
      if (!known) throw py::type_error("no field is named " + name);
    }
  }
  keywords.owner->validate(object);
}

const Keywords& keywords_of(const function_call& call) {
  return *static_cast<const Keywords*>(call.func.data[0]);
}

py::handle call_constructor(function_call& call) {
  const Keywords& keywords = keywords_of(call);
  ClassTable::Object object = keywords.owner->make();
  if (!keywords.load(call, 1, object.get())) return PYBIND11_TRY_NEXT_OVERLOAD;
  construct(call, std::move(object));
  return py::none().release();
}

py::handle call_replace(function_call& call) {
  const Keywords& keywords = keywords_of(call);
  const void* self = self_of(call, *keywords.owner->type);
  if (!self) return PYBIND11_TRY_NEXT_OVERLOAD;
  ClassTable::Object object = keywords.owner->copy(self);
  change(object.get(), py::reinterpret_borrow<py::dict>(call.args[1]), keywords);
  return keywords.owner->release(std::move(object)).release();
}

py::handle call_getstate(function_call& call) {
  const auto& pickling = *static_cast<const Pickling*>(call.func.data[0]);
  const void* self = self_of(call, *pickling.type);
  if (!self) return PYBIND11_TRY_NEXT_OVERLOAD;
  return pickling.get(self).release();
}

py::handle call_setstate(function_call& call) {
  const auto& pickling = *static_cast<const Pickling*>(call.func.data[0]);
  construct(call, pickling.set(py::reinterpret_borrow<py::object>(call.args[1])));
  return py::none().release();
}

/// Pickling as a dictionary of the fields.
Pickling pickling_of(const Keywords& keywords) {
  const auto get = [keywords](const void* object) {
    py::dict state;
    for (const Keyword& keyword : keywords.list)
      state[keyword.name] = keyword.value_in(object, py::return_value_policy::copy);
    return state;
  };
  const auto set = [keywords](const py::object& state) {
    if (!py::isinstance<py::dict>(state)) throw py::reference_cast_error();
    ClassTable::Object object = keywords.owner->make();
    change(object.get(), state, keywords);
    return object;
  };
  return {keywords.owner->type, &ConversionsOf<State>::to_python, get, set};
}

struct Property {
  const std::type_info* type;
  Keyword keyword;
};

py::handle call_getter(function_call& call) {
  const auto& property = *static_cast<const Property*>(call.func.data[0]);
  const void* self = self_of(call, *property.type);
  if (!self) return PYBIND11_TRY_NEXT_OVERLOAD;
  return property.keyword.value_in(self, call.func.policy, call.parent).release();
}

struct Repr {
  std::string name;
  Keywords keywords;
};

py::handle call_repr(function_call& call) {
  const auto& [name, keywords] = *static_cast<const Repr*>(call.func.data[0]);
  const void* self = self_of(call, *keywords.owner->type);
  if (!self) return PYBIND11_TRY_NEXT_OVERLOAD;
  std::string text;
  const ClassTable::Object defaults = keywords.owner->make();
  for (const Keyword& keyword : keywords.list) {
    const std::string value = repr_in(keyword, self);
    if (value == repr_in(keyword, defaults.get())) continue;
    text += (text.empty() ? "" : ", ") + std::string(keyword.name) + "=" + value;
  }
  return py::str(name + "(" + text + ")").release();
}

/// Attributes of a method, as py::class_::def() gives them.
Function& as_method(Function& function, py::handle cls, const char* name) {
  return function.annotated(py::name(name), py::is_method(cls),
                            py::sibling(py::getattr(cls, name, py::none())));
}

/// Text of `self`.
Function& begun(Function& function, const std::type_info& type) {
  const std::type_info* types[] = {&type, nullptr};
  return function.text("({%}", types);
}

Function& begun_constructor(Function& function) {
  static const std::type_info* const types[] = {&typeid(py::detail::value_and_holder), nullptr};
  return function.annotated(py::detail::is_new_style_constructor()).text("({%}", types);
}

}  // namespace

bool Keywords::load(const function_call& call, std::size_t first, void* object) const {
  for (const Keyword& keyword : list) {
    if (!keyword.load(call.args[first], call.args_convert[first], object)) return false;
    ++first;
  }
  owner->validate(object);
  return true;
}

std::string object_repr(py::object object, bool is_enum) {
  if (py::isinstance<py::array>(object)) object = (object + py::float_(0.0)).attr("tolist")();
  if (is_enum)
    return py::cast<std::string>(py::str(py::type::of(object).attr("__name__"))) + "." +
           py::cast<std::string>(object.attr("name"));
  return py::cast<std::string>(py::repr(object));
}

std::string fields_doc(const Keywords& keywords, const char* title) {
  std::string text = std::string("\n\n") + title + ":\n";
  for (const Keyword& keyword : keywords.list)
    text += std::string("  ") + keyword.name + ": " + keyword.doc + "\n";
  return text;
}

void define_property(py::object& cls, const std::type_info& type, const Keyword& keyword) {
  const py::handle property(reinterpret_cast<PyObject*>(&PyProperty_Type));
  Function getter(&call_getter, Property{&type, keyword}, 1);
  getter.annotated(py::is_method(cls), py::return_value_policy::reference_internal);
  begun(getter, type).text(") -> ").text(keyword.type->text, keyword.type->types).made();
  cls.attr(keyword.name) = property(getter, py::none(), py::none(), keyword.doc);
}

void define_properties(py::object& cls, const Keywords& keywords) {
  for (const Keyword& keyword : keywords.list) define_property(cls, *keywords.owner->type, keyword);
}

void define_pickling(py::object& cls, const Pickling& pickling) {
  const std::string text = pickling.state->text;
  Function get(&call_getstate, pickling, 1);
  as_method(get, cls, "__getstate__").annotated(py::pos_only());
  begun(get, *pickling.type).text((") -> " + text).c_str(), pickling.state->types).made();
  cls.attr("__getstate__") = get;
  Function set(&call_setstate, pickling, 2);
  begun_constructor(as_method(set, cls, "__setstate__"))
      .text((", {" + text + "}) -> None").c_str(), pickling.state->types)
      .made();
  cls.attr("__setstate__") = set;
}

void define_repr(py::object& cls, const char* name, const Keywords& keywords) {
  Function repr(&call_repr, Repr{name, keywords}, 1);
  begun(as_method(repr, cls, "__repr__"), *keywords.owner->type).text(") -> str").made();
  cls.attr("__repr__") = repr;
}

void define_value(py::object& cls, const Keywords& keywords) {
  Function init(&call_constructor, keywords, 1);
  begun_constructor(as_method(init, cls, "__init__").annotated(py::kw_only()))
      .keywords(keywords)
      .text(") -> None")
      .made();
  cls.attr("__init__") = init;
  define_properties(cls, keywords);
  Function replace(&call_replace, keywords, 1);
  as_method(replace, cls, "replace").annotated("Returns a copy with the given fields changed.");
  const std::type_info* types[] = {keywords.owner->type, nullptr};
  begun(replace, *keywords.owner->type).takes_more().text(") -> %", types).made();
  cls.attr("replace") = replace;
  define_pickling(cls, pickling_of(keywords));
}

Function& Function::text(const char* text, Types types) {
  text_ += text;
  for (; types && *types; ++types) types_.push_back(*types);
  return *this;
}

Function& Function::keywords(const Keywords& keywords) {
  const ClassTable::Object defaults = keywords.owner->make();
  for (const Keyword& keyword : keywords.list) {
    if (keyword.is_required) {
      annotated(py::arg(keyword.name));
    } else {
      const py::object value = keyword.value_in(defaults.get(), py::return_value_policy::automatic);
      texts_.push_back(default_text(keyword, value));
      annotated(py::arg_v(keyword.name, value, texts_.back().c_str()));
    }
    text(count_++ == 0 ? "{" : ", {").text(keyword.type->text, keyword.type->types).text("}");
  }
  return *this;
}

Function& Function::takes_more() {
  record_->has_kwargs = true;
  ++count_;
  return text((std::string(", {") + ConversionsOf<Changes>::name.text + "}").c_str(),
              ConversionsOf<Changes>::types.data());
}

void Function::made() {
  types_.push_back(nullptr);
  initialize_generic(std::move(record_), text_.c_str(), types_.data(), count_);
}

}  // namespace occ::python
