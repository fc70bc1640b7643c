#include "apps/viewer/script.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "apps/scene/outputs.hpp"
#include "apps/viewer/window.hpp"
#include "base/error.hpp"
#include "config/yaml.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

/// The arguments of a command, and where it prints.
struct Arguments {
    const std::vector<std::string>& words;
    const ViewScript::Printer& print;

    double number(std::size_t i) const { return *parse_number(words[i]); }
    int whole(std::size_t i) const { return static_cast<int>(number(i)); }
    /// Three numbers in mm, converted to m.
    Vector3 place(std::size_t i) const {
        return 1e-3 * Vector3(number(i), number(i + 1), number(i + 2));
    }
    template <class T>
    T one_of(std::size_t i, std::initializer_list<std::pair<const char*, T>> choices) const {
        std::string names;
        for (const auto& [name, value] : choices) {
            if (words[i] == name) return value;
            names += fmt::format("{}{}", names.empty() ? "" : ", ", name);
        }
        fail("{}: expected one of {}", words[i], names);
    }
};

struct Command {
    const char* name;
    const char* shape;  ///< a letter for each argument: n number, w word
    const char* arguments;
    const char* does;
    void (*run)(ViewWindow&, const Stage&, const Arguments&);
};

void need_recording(bool there) {
    if (!there) fail("a run in progress has no frames to go to, expected `play`");
}

std::array<int, 2> pixel(const Arguments& a, std::size_t i) { return {a.whole(i), a.whole(i + 1)}; }

const Command commands[] = {
    {"frame", "n", "N", "shows frame N, counted from 1",
     [](ViewWindow&, const Stage& stage, const Arguments& a) {
         need_recording(static_cast<bool>(stage.go_to_frame));
         if (!(a.number(0) >= 1)) fail("frame {}: expected 1 or more", a.words[0]);
         stage.go_to_frame(static_cast<std::size_t>(a.number(0)) - 1);
     }},
    {"time", "n", "S", "shows the frame at S seconds from the first",
     [](ViewWindow&, const Stage& stage, const Arguments& a) {
         need_recording(static_cast<bool>(stage.go_to_time));
         stage.go_to_time(a.number(0));
     }},
    {"play", "n", "S", "plays for S seconds",
     [](ViewWindow&, const Stage& stage, const Arguments& a) { (void)stage.play(a.number(0)); }},
    {"colour", "w", "displacement|stress|error", "quantity that colours the surface",
     [](ViewWindow& w, const Stage&, const Arguments& a) {
         const auto what = a.one_of<ColourBy>(0, {{"displacement", ColourBy::displacement},
                                                  {"stress", ColourBy::von_mises},
                                                  {"error", ColourBy::stated_error}});
         with_context("colour " + a.words[0], [&] { w.set_colour(what); });
     }},
    {"slices", "w", "deformed|rest", "which image the slices show",
     [](ViewWindow& w, const Stage&, const Arguments& a) {
         w.set_deformed(a.one_of<bool>(0, {{"deformed", true}, {"rest", false}}));
     }},
    {"cross", "nnn", "X Y Z", "moves the cross-hair there, mm RAS",
     [](ViewWindow& w, const Stage&, const Arguments& a) { w.set_cross(a.place(0)); }},
    {"window", "nn", "WINDOW LEVEL",
     "grey values shown: their width from black to white, and their centre",
     [](ViewWindow& w, const Stage&, const Arguments& a) {
         w.set_window(a.number(0), a.number(1));
     }},
    {"volume", "w", "on|off", "shows the image within the organ as a volume",
     [](ViewWindow& w, const Stage&, const Arguments& a) {
         w.set_volume(a.one_of<bool>(0, {{"on", true}, {"off", false}}));
     }},
    {"look", "w", "front|back|left|right|above|below", "views from a side of the patient",
     [](ViewWindow& w, const Stage&, const Arguments& a) {
         w.look_from(a.one_of<Look>(0, {{"front", Look::front},
                                        {"back", Look::back},
                                        {"left", Look::left},
                                        {"right", Look::right},
                                        {"above", Look::above},
                                        {"below", Look::below}}));
     }},
    {"zoom", "n", "FACTOR", "zooms in, or out below 1",
     [](ViewWindow& w, const Stage&, const Arguments& a) { w.zoom(a.number(0)); }},
    {"reset", "", "", "shows the whole organ and whole slices",
     [](ViewWindow& w, const Stage&, const Arguments&) { w.reset(); }},
    {"pull", "nnnnnn", "X Y Z DX DY DZ",
     "sets a marker and pulls it by DX DY DZ, mm; only during a run",
     [](ViewWindow& w, const Stage& stage, const Arguments& a) {
         if (stage.go_to_frame) fail("a recorded result cannot be pulled, expected a scene to run");
         w.pull(a.place(0), a.place(0) + a.place(3));
     }},
    {"release", "", "", "releases the marker",
     [](ViewWindow& w, const Stage&, const Arguments&) { w.release(); }},
    {"drag", "wnnnn", "left|middle|right X0 Y0 X1 Y1",
     "drags the mouse with a button down, in pixels from the lower left",
     [](ViewWindow& w, const Stage&, const Arguments& a) {
         w.drag(a.one_of<MouseButton>(0, {{"left", MouseButton::left},
                                          {"middle", MouseButton::middle},
                                          {"right", MouseButton::right}}),
                pixel(a, 1), pixel(a, 3));
     }},
    {"key", "w", "KEY", "presses a key of the window: space, Left, c, d ...",
     [](ViewWindow& w, const Stage&, const Arguments& a) { w.press_key(a.words[0]); }},
    {"tell", "", "", "prints what is shown, as a line of JSON",
     [](ViewWindow& w, const Stage&, const Arguments& a) {
         if (a.print) a.print(w.state());
     }},
    {"screenshot", "w", "FILE.png", "writes what is shown",
     [](ViewWindow& w, const Stage&, const Arguments& a) { w.write_png(a.words[0]); }},
};

}  // namespace

std::string ViewScript::reference() {
    std::string text;
    for (const Command& c : commands)
        text += fmt::format("  {:<52} {}\n", fmt::format("{} {}", c.name, c.arguments), c.does);
    return text;
}

ViewScript::ViewScript(const std::string& text, const std::string& source, Printer print)
    : source_(source), print_(std::move(print)) {
    std::istringstream in(text);
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
        std::istringstream parts(line.substr(0, line.find('#')));
        std::string name, word;
        if (!(parts >> name)) continue;
        Line next{number, 0, {}};
        while (parts >> word) next.words.push_back(word);
        const auto found = std::find_if(std::begin(commands), std::end(commands),
                                        [&](const Command& c) { return name == c.name; });
        if (found == std::end(commands)) {
            std::vector<std::string> names;
            for (const Command& c : commands) names.emplace_back(c.name);
            const std::string nearest = nearest_name(name, names);
            fail("{}:{}: unknown command {}, {}", source, number, name,
                 nearest.empty() ? fmt::format("expected one of {}", fmt::join(names, ", "))
                                 : fmt::format("did you mean {}?", nearest));
        }
        const std::string_view shape = found->shape;
        bool fits = next.words.size() == shape.size();
        for (std::size_t i = 0; fits && i < shape.size(); ++i)
            fits = shape[i] == 'w' ||
                   std::isfinite(parse_number(next.words[i]).value_or(std::nan("")));
        if (!fits)
            fail("{}:{}: found {} {}, expected {} {}", source, number, name,
                 fmt::join(next.words, " "), name, found->arguments);
        if (name == "screenshot")
            expect_ending(fmt::format("{}:{}: screenshot", source, number), next.words[0],
                          ".png");  // so that no image or result is overwritten
        next.command = static_cast<std::size_t>(found - std::begin(commands));
        lines_.push_back(std::move(next));
    }
    if (lines_.empty()) fail("{}: holds no command, expected at least one", source);
}

void ViewScript::run(ViewWindow& window, const Stage& stage) const {
    for (const Line& line : lines_) {
        with_context(fmt::format("{}:{}", source_, line.number), [&] {
            commands[line.command].run(window, stage, {line.words, print_});
        });
        window.draw();
        (void)window.process_events();
    }
}

}  // namespace livetet
