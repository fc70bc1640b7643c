#include "house/sizes.hpp"

#include <algorithm>
#include <cctype>
#include <regex>

namespace livetet::house {
namespace {

/// Without what stands between < and > of templates: of "A<B(C)> d" leaves "A<> d".
std::string without_templates(std::string_view text) {
    std::string left;
    int depth = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const bool arrow = text[i] == '>' && i > 0 && text[i - 1] == '-';
        const bool opens = text[i] == '<' && i > 0 && !left.ends_with("operator") &&
                           (std::isalnum(text[i - 1]) || text[i - 1] == '_');
        const bool opens_template = text[i] == '<' && left.ends_with("template ");
        if (opens || opens_template || (depth > 0 && text[i] == '<')) {
            if (depth++ == 0) {
                left += '<';
            }
            continue;
        }
        if (text[i] == '>' && depth > 0 && !arrow) {
            if (--depth == 0) {
                left += '>';
            }
            continue;
        }
        if (depth == 0) {
            left += text[i];
        }
    }
    return left;
}

/// A declaration's text on one line: no templates, attributes, access labels.
std::string tidy_head(std::string head) {
    static const std::regex space(R"(\s+)"), label(R"(^(\s*(public|private|protected)\s*:)+)"),
        attribute(R"(\[\[[^\]]*\]\]|alignas\s*\([^)]*\))"), parameters(R"(^\s*template <>\s*)"),
        ends(R"(^\s+|\s+$)");
    head = std::regex_replace(std::regex_replace(head, attribute, " "), space, " ");
    head = without_templates(std::regex_replace(head, label, ""));
    for (std::string before; before != head;) {
        before = head;
        head = std::regex_replace(head, parameters, "");
    }
    return std::regex_replace(head, ends, "");
}

/// Without what stands between parentheses: of "f(g(a), b) = c" leaves "f() = c".
std::string without_arguments(std::string_view text) {
    std::string left;
    int depth = 0;
    for (const char c : text) {
        depth -= c == ')';
        if (depth == 0) {
            left += c;
        }
        depth += c == '(';
    }
    return left;
}

enum class Brace { scope, class_scope, function, initializer };

Brace kind_of(const std::string& tidy) {
    static const std::regex scope(R"(^(inline )?namespace\b|^extern "\s*"$)"),
        class_head(R"(\b(class|struct|union)\b)"), enumeration(R"(^enum\b)"),
        member_initializer(R"(\)( noexcept)? ?: .*[A-Za-z0-9_>]$)");
    if (std::regex_search(tidy, scope)) {
        return Brace::scope;
    }
    const auto plain = without_arguments(tidy);
    const bool called = plain.find('(') != plain.npos;
    if (std::regex_search(plain, enumeration) || plain.find(" = ") != plain.npos) {
        return Brace::initializer;
    }
    if (!called) {
        return std::regex_search(plain, class_head) ? Brace::class_scope : Brace::initializer;
    }
    return std::regex_search(plain, member_initializer) ? Brace::initializer : Brace::function;
}

/// How many data members a statement at class scope declares.
int data_members(const std::string& tidy) {
    static const std::regex other(
        R"(^(static|using|friend|typedef|template|enum|class|struct|union|constexpr|inline static)\b)"),
        function_pointer(R"(^[^(]*\(\*\w+\)\()");
    if (tidy.empty() || std::regex_search(tidy, other) || tidy.find("operator") != tidy.npos) {
        return 0;
    }
    const auto plain = without_arguments(tidy);
    if (std::regex_search(tidy, function_pointer)) {
        return 1;
    }
    // "int a, b = f(1), c{}": the first declarator decides whether it is a function.
    const auto first = plain.substr(0, plain.find(','));
    const auto declared = first.substr(0, first.find(" = "));
    if (declared.find('(') != declared.npos) {
        return 0;
    }
    return 1 + static_cast<int>(std::count(plain.begin(), plain.end(), ','));
}

class Scanner {
  public:
    explicit Scanner(std::string_view source) : text_(blanked(source)) {}

    Sizes scan() {
        for (at_ = 0; at_ < text_.size(); ++at_) {
            const char c = text_[at_];
            if (head_.empty() && std::isspace(static_cast<unsigned char>(c))) {
                line_ += c == '\n';
                continue;
            }
            if (head_.empty()) {
                head_line_ = line_;
            }
            line_ += c == '\n';
            parentheses_ += (c == '(') - (c == ')');
            if (c == '{') {
                open_brace();
            } else if (c == '}') {
                close_scope();
            } else if (c == ';' && parentheses_ == 0) {
                end_statement();
            } else {
                head_ += c;
                drop_label();
            }
        }
        return std::move(sizes_);
    }

  private:
    struct Scope {
        bool is_class;
        Size size;
    };

    void open_brace() {
        const auto head = tidy_head(head_);
        const auto kind = parentheses_ > 0 ? Brace::initializer : kind_of(head);
        if (kind == Brace::scope || kind == Brace::class_scope) {
            scopes_.push_back({kind == Brace::class_scope, {head, head_line_, 0}});
            head_.clear();
            return;
        }
        skip_braces();
        const bool lambda = head.find("= [") != head.npos;
        if (kind == Brace::function || (lambda && parentheses_ == 0)) {
            sizes_.functions.push_back({head, head_line_, line_ - head_line_ + 1});
        }
        if (kind == Brace::function) {
            head_.clear();
        } else {
            head_ += "{}";
        }
    }

    /// From an opening brace to the one that closes it.
    void skip_braces() {
        int depth = 0;
        for (; at_ < text_.size(); ++at_) {
            line_ += text_[at_] == '\n';
            depth += (text_[at_] == '{') - (text_[at_] == '}');
            if (depth == 0) {
                return;
            }
        }
    }

    void close_scope() {
        if (!scopes_.empty()) {
            if (scopes_.back().is_class) {
                sizes_.classes.push_back(scopes_.back().size);
            }
            scopes_.pop_back();
        }
        head_.clear();
    }

    void end_statement() {
        if (!scopes_.empty() && scopes_.back().is_class) {
            scopes_.back().size.size += data_members(tidy_head(head_));
        }
        head_.clear();
    }

    /// A declaration begins after the label before it.
    void drop_label() {
        for (const auto* label : {"public:", "private:", "protected:"}) {
            if (head_ == label) {
                head_.clear();
            }
        }
    }

    std::string text_;
    std::size_t at_ = 0;
    int line_ = 1, head_line_ = 1, parentheses_ = 0;
    std::string head_;  ///< of what is being declared, so far
    std::vector<Scope> scopes_;
    Sizes sizes_;
};

}  // namespace

Sizes measure(std::string_view source) { return Scanner(source).scan(); }

std::string blanked(std::string_view source) {
    std::string text(source);
    const auto blank = [&](std::size_t from, std::size_t to) {
        for (auto i = from; i < std::min(to, text.size()); ++i) {
            text[i] = text[i] == '\n' ? '\n' : ' ';
        }
    };
    const auto find = [&](std::string_view what, std::size_t from) {
        return std::min(source.find(what, from), source.size());
    };
    bool line_begins = true;
    for (std::size_t i = 0; i < source.size(); ++i) {
        const auto rest = source.substr(i);
        const bool separator = rest[0] == '\'' && i > 0 && std::isalnum(source[i - 1]);  // 1'000
        std::size_t end = i;
        if (rest.starts_with("//")) {
            end = find("\n", i);
            blank(i, end);
        } else if (rest.starts_with("/*")) {
            end = find("*/", i) + 2;
            blank(i, end);
        } else if (rest.starts_with("R\"")) {
            const auto open = find("(", i);
            const auto close =
                ")" + std::string(source.substr(i + 2, std::min(open, source.size()) - i - 2)) +
                "\"";
            end = find(close, open) + close.size();
            blank(i, end);
        } else if ((rest[0] == '"' || rest[0] == '\'') && !separator) {
            for (end = i + 1; end < source.size() && source[end] != rest[0]; ++end) {
                end += source[end] == '\\';
            }
            blank(i + 1, end++);
        } else if (rest[0] == '#' && line_begins) {
            for (end = find("\n", i); end > 0 && source[end - 1] == '\\';) {
                end = find("\n", end + 1);
            }
            blank(i, end);
        }
        line_begins = source[i] == '\n' || (line_begins && std::isspace(source[i]));
        i = std::max(i, end - (end > i));
    }
    return text;
}

}  // namespace livetet::house
