#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "support/program.hpp"

namespace livetet::test {

/// The shipped program under way in `folder`, its output in NAME.out and NAME.err; killed with the
/// guard if it still runs.
class Running {
  public:
    Running(const Folder& folder, const std::string& name, std::vector<std::string> arguments)
        : out_(folder / (name + ".out")), err_(folder / (name + ".err")) {
        arguments.insert(arguments.begin(), LIVETET_PROGRAM);
        std::vector<char*> words;
        for (std::string& a : arguments) words.push_back(a.data());
        words.push_back(nullptr);
        child_ = ::fork();
        if (child_ != 0) return;
        redirect("/dev/null", O_RDONLY, STDIN_FILENO);
        redirect(out_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, STDOUT_FILENO);
        redirect(err_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, STDERR_FILENO);
        if (::chdir(folder.path().c_str()) == 0) ::execv(words[0], words.data());
        ::_exit(127);
    }
    ~Running() {
        if (child_ <= 0) return;
        ::kill(child_, SIGKILL);
        (void)wait();
    }
    Running(const Running&) = delete;
    Running& operator=(const Running&) = delete;

    /// As Ctrl-C does.
    void interrupt() const { send(SIGINT); }
    void send(int signal) const { ::kill(child_, signal); }
    /// Its end: exit status and output.
    Outcome wait() {
        int raw = 0;
        ::waitpid(std::exchange(child_, -1), &raw, 0);
        return {WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw), text_of(out_),
                text_of(err_)};
    }
    /// Waits until its standard output has `text`; false where it does not come in all patience.
    bool says(const std::string& text) const {
        for (int i = 0; i < 3000; ++i) {
            if (text_of(out_).find(text) != std::string::npos) return true;
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        return false;
    }
    std::string output() const { return text_of(out_); }
    std::string errors() const { return text_of(err_); }

  private:
    static void redirect(const char* path, int flags, int descriptor) {
        const int file = ::open(path, flags, 0600);
        if (file < 0 || ::dup2(file, descriptor) < 0) ::_exit(126);
    }
    std::filesystem::path out_, err_;
    pid_t child_ = -1;
};

/// `livetet serve SOURCE --port 0 ...`, listening.
class Server : public Running {
  public:
    Server(const Folder& folder, const std::string& source, std::vector<std::string> options = {})
        : Running(folder, "serve", with(source, std::move(options))) {
        EXPECT_TRUE(says(" sends ")) << "the server does not listen";
        url_ = output().substr(0, output().find(' '));
    }
    /// openigtlink://127.0.0.1:port
    const std::string& url() const { return url_; }

  private:
    static std::vector<std::string> with(const std::string& source,
                                         std::vector<std::string> options) {
        options.insert(options.begin(), {"serve", source, "--port", "0"});
        return options;
    }
    std::string url_;
};

}  // namespace livetet::test
