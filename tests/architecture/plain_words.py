#!/usr/bin/env python3
"""Counts habits that make comments and documents hard to read, and compares the counts with a limit
per room.

  plain_words.py             fails if a room has more than plain_words.csv allows
  plain_words.py --refresh   lowers the limits to the counts of today; it never raises one
  plain_words.py --show ROOM prints the places of a room ("server/watch", "documents")

The unit is the number of places per 1,000 words. Long sentences are counted apart."""

import argparse
import csv
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LIMITS = Path(__file__).with_name("plain_words.csv")
LONG = "long"
LONGEST = 30  # Words of a sentence.

PREPOSITIONS = "of by from with for to in on as into about after before behind beside"
VERBS = "is are was be has have takes gives holds keeps tells knows shows needs"


def any_of(words):
    return "(?:" + "|".join(words.split()) + ")"


HABITS = {
    "clause in place of a noun": [
        rf"\b(?:{any_of(PREPOSITIONS)}|{any_of(VERBS)}|and|or|but|not|all|than) what\b",
        r"\b(?:that|those) of\b",
        r"\b(?:whoever|whom|somebody|nobody|everybody|anybody)\b",
        r"^(?:What|Who|Whose|Whoever|Whatever|Which|That of|Those (?:of|that|who|which))\b",
    ],
    "fragment": [
        r"^Of (?:a|an|the|one|it|each|all|what|those|them|which|such|both|every)\b",
        r"^(?:As|So) (?:many|much|often|long|soon|few|that)\b",
        r"^(?:After|By|In) which\b",
    ],
    "quantity without a noun": [r"\b(?:so|as) (?:many|much|often|little)\b", r"\bof such\b"],
    "a thing that speaks": [
        r"\b(?:is|are|was|were|be|been) (?:told|asked|wanted|meant|heard|said|believed)\b",
        r"\btells? (?:of|what|whether|how|that|it|them|the|when|where|which|who|why|nothing)\b",
        r"\b(?:hears?|heard) (?:of|what|from)\b",
        r"\bgives? way\b",
    ],
    "dated word": [
        r"\b(?:hence|thereby|thereof|whereby|whence|likewise|meanwhile|anew|of late)\b",
        r"\b(?:goes?|went|going) on\b",
        r"\b(?:go|goes|gone) away\b",
        r"\b(?:is|are|has|have) (?:gone|over)\b",
        r"\b(?:of|by) (?:its|their|one's) own\b",
    ],
}
PATTERNS = [re.compile(pattern, 0 if pattern.startswith("^") else re.IGNORECASE)
            for patterns in HABITS.values() for pattern in patterns]

SLASHES = {".h", ".cc", ".c", ".ts", ".mjs", ".js", ".proto"}
HASHES = {".py", ".sh", ".cmake"}
SLASH_COMMENT = re.compile(r"^\s*(?:///?<?|\*)\s?(.*)$|^.*[;{},)]\s*///?<?\s(.*)$")
HASH_COMMENT = re.compile(r"^\s*#(?!!)\s?(.*)$")


def lines_of(path, text):
    """(line number, text) of each line of prose."""
    if path.suffix == ".md":
        text = re.sub(r"```.*?```", lambda code: "\n" * code.group().count("\n"), text, flags=re.S)
        for number, line in enumerate(text.split("\n"), 1):
            yield number, re.sub(r"^[\s|>#*\-\d.]+", "", line).replace("|", ". ")
        return
    comment = SLASH_COMMENT if path.suffix in SLASHES else HASH_COMMENT
    for number, line in enumerate(text.split("\n"), 1):
        if match := comment.match(line):
            yield number, next((group for group in match.groups() if group), "")


def sentences_of(lines):
    """(line number, sentence). Adjacent lines belong to one text."""
    block, first, last = [], 0, 0

    def split():
        for sentence in re.split(r"(?<=[.!?:;])\s+(?=[A-Z`'\"(\d-])", " ".join(block)):
            if len(sentence.split()) >= 3 and re.search("[a-z]{3}", sentence):
                yield first, sentence.strip()

    for number, text in lines:
        if block and (number != last + 1 or not text.strip()):
            yield from split()
            block = []
        if text.strip():
            first = first if block else number
            block.append(text.strip())
        last = number
    yield from split()


def places_of(sentence):
    plain = re.sub("`[^`]*`", "X", sentence)
    found = sum(bool(pattern.search(plain)) for pattern in PATTERNS)
    return found, int(len(plain.split()) > LONGEST)


def room_of(path):
    if path.suffix == ".md":
        return "documents"
    parts = path.parts[:-1]
    depth = 3 if parts[:2] == ("core", "src") else 2
    return "/".join(parts[:depth]) or "top"


class Room:
    def __init__(self):
        self.words = self.places = self.long = 0

    def rates(self):
        scale = 1000 / max(self.words, 1)
        return round(self.places * scale, 1), round(self.long * scale, 1)


def count(show=None):
    listed = subprocess.run(["git", "-C", ROOT, "ls-files"], check=True, capture_output=True,
                            text=True).stdout.split("\n")
    rooms = {}
    for name in listed:
        path = Path(name)
        known = path.suffix in SLASHES | HASHES | {".md"}
        if not known or "corpus" in path.parts or not (ROOT / path).is_file():
            continue
        room = rooms.setdefault(room_of(path), Room())
        text = (ROOT / path).read_text(errors="replace")
        for number, sentence in sentences_of(lines_of(path, text)):
            places, long = places_of(sentence)
            room.words += len(sentence.split())
            room.places += places
            room.long += long
            if show == room_of(path) and places + long:
                print(f"{name}:{number}: {sentence}")
    return {name: room.rates() for name, room in rooms.items() if room.words >= 50}


def read_limits():
    with open(LIMITS, newline="", encoding="utf-8") as file:
        return {row["room"]: (float(row["places"]), float(row["long"]))
                for row in csv.DictReader(file)}


def excesses(rates, limits):
    """A line for each room above its limit. A new room must be as plain as the default."""
    lines = []
    for room, (places, long) in sorted(rates.items()):
        most, most_long = limits.get(room, limits["default"])
        if places > most or long > most_long:
            lines.append(f"{room}: {places} places and {long} long sentences per 1,000 words, "
                         f"allowed {most} and {most_long}")
    return lines


def lowered(rates, limits):
    default = limits["default"]
    rooms = {room: tuple(map(min, limits.get(room, rate), rate)) for room, rate in rates.items()}
    return {"default": default,
            **{room: rate for room, rate in sorted(rooms.items())
               if rate[0] > default[0] or rate[1] > default[1]}}


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--show", metavar="ROOM", help="print the places of a room")
    parser.add_argument("--refresh", action="store_true", help="lower the limits")
    arguments = parser.parse_args()
    rates = count(arguments.show)
    if arguments.refresh:
        limits = lowered(rates, read_limits())  # Read before the file is truncated.
        with open(LIMITS, "w", encoding="utf-8") as file:
            file.write("room,places,long\n")
            file.writelines(f"{room},{places},{long}\n"
                            for room, (places, long) in limits.items())
    if arguments.show or arguments.refresh:
        return
    if lines := excesses(rates, read_limits()):
        sys.exit("\n".join(lines + ["`plain_words.py --show ROOM` prints the places."]))


if __name__ == "__main__":
    main()
