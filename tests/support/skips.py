#!/usr/bin/python3
"""Lists the skipped tests.

    skips.py ctest CONSOLE_LOG LAST_TEST_LOG   CTest's console output and its LastTest.log
    skips.py node LOG                          output of node's test runner
    skips.py step NAME...                      skipped steps of tests/run.sh

Prints a line "NAME<tab>REASON" for each; REASON is the entry of NAME in tests/skips.txt, or empty.
A test inside a Python program is CTEST_NAME/test_method.
"""

import pathlib
import re
import sys

LIST = pathlib.Path(__file__).resolve().parent.parent / "skips.txt"

CTEST_SKIPPED = re.compile(r"^ *\d+/\d+ Test +#\d+: (\S+) \.*\*\*\*Skipped", re.MULTILINE)
CTEST_OUTPUT = re.compile(r"^\d+/\d+ Test: (\S+)\n.*?^Output:\n-+\n(.*?)^<end of output>$",
                          re.MULTILINE | re.DOTALL)
# Python's unittest: "OK (skipped=2)", and with -v "test_name (Class) ... skipped 'reason'".
PYTHON_COUNT = re.compile(r"^(?:OK|FAILED) \(.*?\bskipped=(\d+)", re.MULTILINE)
PYTHON_SKIPPED = re.compile(r"^ *(test_\w+) \([^\n]*\)(?:\n[^\n]*)?? \.\.\. skipped ", re.MULTILINE)
# Node's reporters `spec` and `tap`.
NODE_SKIPPED = re.compile(r"^ *(?:﹣ (.*?) \([\d.]+ms\)|ok \d+ - (.*?) # SKIP)", re.MULTILINE)
NODE_COUNT = re.compile(r"^\S+ skipped (\d+)$", re.MULTILINE)


def listed(text):
    """The reasons of a list, by name."""
    reasons = {}
    for line in text.splitlines():
        if line.strip() and not line.startswith("#"):
            name, reason = line.split(None, 1)  # A name without a reason is an error.
            reasons[name] = reason.strip()
    return reasons


def skipped_in_ctest(console, last_test):
    names = CTEST_SKIPPED.findall(console)
    for program, output in CTEST_OUTPUT.findall(last_test):
        count = sum(map(int, PYTHON_COUNT.findall(output)))
        methods = PYTHON_SKIPPED.findall(output)[:count]
        names += [f"{program}/{method}" for method in methods]
        if count > len(methods):  # Without -v there are no names.
            names.append(program)
    return names


def skipped_in_node(log):
    names = [first or second for first, second in NODE_SKIPPED.findall(log)]
    count = sum(map(int, NODE_COUNT.findall(log)))
    return names[:count] + ["node"] * (count > len(names))


def main():
    kind, *arguments = sys.argv[1:]
    if kind == "step":
        names = arguments
    else:
        logs = [pathlib.Path(path).read_text(errors="replace") for path in arguments]
        names = {"ctest": skipped_in_ctest, "node": skipped_in_node}[kind](*logs)
    reasons = listed(LIST.read_text())
    for name in names:
        print(name.replace(" ", "_"), reasons.get(name.replace(" ", "_"), ""), sep="\t")


if __name__ == "__main__":
    main()
