// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/internal/yaml_node.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <sstream>
#include <stdexcept>

#include "libocc/core/internal/file.hpp"

namespace occ::internal::core {

namespace {

constexpr std::size_t max_bytes = 4u << 20;  // about 50000 lamps
constexpr std::size_t max_nodes = 1000000;
constexpr std::size_t max_depth = 16;    // a scene has 4 levels
constexpr int max_open_brackets = 1000;  // strings may contain brackets, too
constexpr char too_deep[] = "nested deeper than a scene can be";

[[noreturn]] void fail(const std::string& name, int line, const std::string& reason) {
  throw std::runtime_error(name + ":" + std::to_string(line) + ": " + reason);
}

int line_of(const YAML::Mark& mark) { return std::max(mark.line, 0) + 1; }

// Builds the tree from the parser's events. An alias may only name a finished node, so the result
// has no cycles.
class TreeBuilder : public YAML::EventHandler {
 public:
  explicit TreeBuilder(std::string name) : name_(std::move(name)) {}

  std::shared_ptr<const YamlNode> root() const { return root_; }

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    add(node(YamlNode::Kind::nothing, mark), anchor);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto found = anchors_.find(anchor);
    if (found == anchors_.end()) fail(name_, line_of(mark), "an alias inside its own anchor");
    attach(found->second, line_of(mark));
  }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                const std::string& value) override {
    auto scalar = node(YamlNode::Kind::scalar, mark);
    scalar->text = value;
    add(scalar, anchor);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(node(YamlNode::Kind::sequence, mark), anchor);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(node(YamlNode::Kind::mapping, mark), anchor);
  }
  void OnMapEnd() override { close(); }

 private:
  struct Open {
    std::shared_ptr<YamlNode> node;
    YAML::anchor_t anchor;
    bool has_key = false;
    YamlNode::Entry entry;
  };

  std::shared_ptr<YamlNode> node(YamlNode::Kind kind, const YAML::Mark& mark) {
    if (++count_ > max_nodes) fail(name_, line_of(mark), "more values than a scene can have");
    auto made = std::make_shared<YamlNode>();
    made->kind = kind;
    made->line = line_of(mark);
    return made;
  }

  void open(std::shared_ptr<YamlNode> made, YAML::anchor_t anchor) {
    if (open_.size() >= max_depth) fail(name_, made->line, too_deep);
    open_.push_back({std::move(made), anchor, false, {}});
  }

  void close() {
    const Open closed = std::move(open_.back());
    open_.pop_back();
    add(closed.node, closed.anchor);
  }

  void add(const std::shared_ptr<YamlNode>& made, YAML::anchor_t anchor) {
    if (anchor != 0) anchors_[anchor] = made;
    attach(made, made->line);
  }

  void attach(const std::shared_ptr<const YamlNode>& made, int line) {
    if (open_.empty()) {
      root_ = made;
      return;
    }
    Open& parent = open_.back();
    if (parent.node->kind == YamlNode::Kind::sequence) {
      parent.node->items.push_back(made);
    } else if (parent.has_key) {
      parent.entry.value = made;
      parent.node->entries.push_back(std::move(parent.entry));
      parent.has_key = false;
    } else {
      if (made->kind != YamlNode::Kind::scalar) fail(name_, line, "a key must be a word");
      parent.entry = {made->text, line, nullptr};
      parent.has_key = true;
    }
  }

  std::string name_;
  std::size_t count_ = 0;
  std::vector<Open> open_;
  std::map<YAML::anchor_t, std::shared_ptr<const YamlNode>> anchors_;
  std::shared_ptr<const YamlNode> root_;
};

void require_text(const std::string& text, const std::string& name) {
  if (text.size() > max_bytes)
    throw std::runtime_error(name + ": " + std::to_string(text.size()) +
                             " bytes are more than a scene or camera file can have");
  int line = 1, open = 0;
  for (const char c : text) {
    const bool is_text =
        static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\r' || c == '\t';
    if (!is_text) fail(name, line, "not a text file");
    if (c == '\n') ++line;
    // yaml-cpp queues every open bracket, 200 bytes each, before the parser knows the depth.
    if (c == '[' || c == '{') ++open;
    if ((c == ']' || c == '}') && open > 0) --open;
    if (open > max_open_brackets) fail(name, line, too_deep);
  }
}

// OpenCV begins its files with "%YAML:1.0", which is not a YAML directive.
std::string without_opencv_directive(const std::string& text) {
  std::string yaml = text;
  if (yaml.compare(0, 6, "%YAML:") == 0) yaml[0] = '#';
  return yaml;
}

}  // namespace

const YamlNode::Entry* YamlNode::find(const std::string& key) const {
  for (const Entry& entry : entries)
    if (entry.key == key) return &entry;
  return nullptr;
}

std::string YamlNode::describe() const {
  switch (kind) {
    case Kind::nothing:
      return "nothing";
    case Kind::scalar:
      return text.empty() ? "an empty text" : printable(text);
    case Kind::sequence:
      return "a list of " + std::to_string(items.size());
    case Kind::mapping:
      break;
  }
  return "a mapping";
}

std::string printable(const std::string& text) {
  constexpr std::size_t longest = 60;
  std::string shown = text.substr(0, longest);
  for (char& c : shown)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  if (text.size() > longest) shown += "...";
  return shown;
}

std::shared_ptr<const YamlNode> parse_yaml(const std::string& text, const std::string& name) {
  require_text(text, name);
  TreeBuilder builder(name);
  try {
    std::istringstream stream(without_opencv_directive(text));
    YAML::Parser parser(stream);
    parser.HandleNextDocument(builder);
    TreeBuilder second(name);
    if (parser.HandleNextDocument(second)) fail(name, 1, "more than one YAML document in a file");
  } catch (const YAML::Exception& error) {
    fail(name, line_of(error.mark), "not YAML: " + error.msg);
  }
  const auto root = builder.root();
  if (!root || root->kind == YamlNode::Kind::nothing) fail(name, 1, "the file is empty");
  if (root->kind != YamlNode::Kind::mapping)
    fail(name, root->line, "must consist of `key: value` lines, got " + root->describe());
  return root;
}

std::shared_ptr<const YamlNode> read_yaml(const std::string& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status))
    throw std::runtime_error(path + ": cannot be read: no such file");
  if (!std::filesystem::is_regular_file(status))
    throw std::runtime_error(path + ": cannot be read: not a file" +
                             (std::filesystem::is_directory(status) ? " but a folder" : ""));
  if (std::filesystem::file_size(path, error) > max_bytes)
    throw std::runtime_error(path + ": larger than a scene or camera file can be");
  return parse_yaml(read_file(path), path);
}

}  // namespace occ::internal::core
