// Single keys from a terminal, without waiting for a line.
#pragma once

#include <poll.h>
#include <termios.h>
#include <unistd.h>

namespace pocd::dds {

/// Puts the terminal back as it was when it goes. Without a terminal, or in the background, it
/// never has a key.
class Keyboard {
 public:
  explicit Keyboard(bool enabled) {
    // In the background, a change of the terminal would stop the process.
    if (!enabled || tcgetpgrp(STDIN_FILENO) != getpgrp()) return;
    if (tcgetattr(STDIN_FILENO, &before_) != 0) return;
    termios raw = before_;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);  // signals stay as they are
    active_ = tcsetattr(STDIN_FILENO, TCSANOW, &raw) == 0;
  }
  ~Keyboard() { release(); }
  /// Puts the terminal back already now.
  void release() {
    if (active_) tcsetattr(STDIN_FILENO, TCSANOW, &before_);
    active_ = false;
  }
  Keyboard(const Keyboard&) = delete;
  Keyboard& operator=(const Keyboard&) = delete;

  /// True when the space key has been pressed an odd number of times since the last call.
  bool space_pressed() {
    bool pressed = false;
    pollfd input{STDIN_FILENO, POLLIN, 0};
    while (active_ && ::poll(&input, 1, 0) == 1 && (input.revents & POLLIN) != 0) {
      char key = 0;
      if (::read(STDIN_FILENO, &key, 1) != 1) break;
      pressed ^= key == ' ';
    }
    return pressed;
  }

 private:
  bool active_ = false;
  termios before_{};
};

}  // namespace pocd::dds
