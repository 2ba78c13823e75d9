#!/usr/bin/env python3
"""tools/run SCENARIO --live: the particles of one run, moving, on a page that a browser of this machine opens, or in the
terminal.

usage: live.py RUNNER SCENARIO --live [page|terminal] [--rate R] [OPTION...]
"""
import math
import os
import sys
import webbrowser

import page
import terminal
from steps import Steps

EXIT_USAGE = 2
RATE = 10.0  # times as fast as the flight was


class Refused(Exception):
    """A line for a person."""


def parse_rate(text):
    try:
        rate = float(text)
    except ValueError:
        rate = math.nan
    if not 0.0 < rate <= 1000.0:
        raise Refused(f"--rate '{text}': give a number above 0, at most 1000: so many times as fast as it was")
    return rate


def parse(words):
    """Where to show it (None: find out), how fast, and what is left for the runner."""
    place, rate, left = None, RATE, []
    words = list(words)
    while words:
        word = words.pop(0)
        if word == "--live":
            if words and words[0] in ("page", "terminal"):
                place = words.pop(0)
        elif word == "--rate":
            if not words:
                raise Refused("--rate needs a value: --rate R")
            rate = parse_rate(words.pop(0))
        else:
            left.append(word)
    return place, rate, left


def has_browser():
    """A desktop to open one on: a browser in the terminal is none."""
    if sys.platform not in ("darwin", "win32") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return False
    try:
        return webbrowser.get() is not None
    except webbrowser.Error:
        return False


def choose(place):
    is_terminal = sys.stdin.isatty() and sys.stdout.isatty()
    if place == "terminal" and not is_terminal:
        raise Refused("--live terminal: standard input and output are no terminal")
    if place is not None:
        return place
    if has_browser():
        return "page"
    if is_terminal:
        return "terminal"
    raise Refused("--live: neither a browser nor a terminal here; --live page serves the page all the same")


def main(arguments):
    runner, *words = arguments
    if "--help" in words or "-h" in words:
        os.execv(runner, [runner, "--help"])
    steps = None
    try:
        place, rate, left = parse(words)
        steps = Steps([runner, *left])
        if not steps.wait(0):
            print(steps.said.replace("--looks", "--live"), end="", file=sys.stderr)
            return steps.code
        if choose(place) == "page":
            page.serve(steps, rate, has_browser())
        else:
            terminal.show(steps, rate)
    except Refused as reason:
        print(f"run: {reason}", file=sys.stderr)
        return EXIT_USAGE
    except KeyboardInterrupt:
        pass  # the way to end it
    finally:
        if steps is not None:
            steps.stop()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
