"""Tests plain_words.py, and checks the project against its limits."""

import unittest
from pathlib import Path

import plain_words


def found(text, suffix=".h"):
    lines = plain_words.lines_of(Path("x" + suffix), text)
    return [plain_words.places_of(sentence)[0] for _, sentence in plain_words.sentences_of(lines)]


class Habits(unittest.TestCase):
    def test_plain_sentences_have_none(self):
        self.assertEqual(found("// Limits these calls to `capacity`.\n"), [0])
        self.assertEqual(found("// Setting a certificate enables TLS.\n"), [0])

    def test_habits_are_found(self):
        for text in ("Whoever names a certificate wants TLS", "As many of them as there are",
                     "The server tells what it knows", "A call gives way to others",
                     "It hence goes on as before", "The size is that of the frame"):
            with self.subTest(text):
                self.assertGreater(sum(found(f"// {text}.\n")), 0)

    def test_code_is_not_read(self):
        self.assertEqual(found("int whoever = 0;\n"), [])
        self.assertEqual(found("```\nwhoever comes goes on\n```\n", ".md"), [])
        self.assertEqual(found("// The flag `whoever` is set here.\n"), [0])

    def test_long_sentences_are_counted_apart(self):
        self.assertEqual(plain_words.places_of("word " * 31), (0, 1))

    def test_sentence_spans_lines(self):
        self.assertEqual(found("// A call gives\n// way to others.\n"), [1])


class Ratchet(unittest.TestCase):
    limits = {"default": (2, 3), "old": (9, 4)}

    def test_room_above_its_limit_fails(self):
        self.assertEqual(plain_words.excesses({"old": (9, 4), "new": (2, 3)}, self.limits), [])
        self.assertEqual(len(plain_words.excesses({"old": (9.1, 0)}, self.limits)), 1)
        self.assertEqual(len(plain_words.excesses({"new": (0, 3.1)}, self.limits)), 1)

    def test_limits_only_fall(self):
        self.assertEqual(plain_words.lowered({"old": (12, 3)}, self.limits)["old"], (9, 3))
        self.assertNotIn("old", plain_words.lowered({"old": (1, 1)}, self.limits))


class Project(unittest.TestCase):
    def test_no_room_is_above_its_limit(self):
        rates, limits = plain_words.count(), plain_words.read_limits()
        self.assertEqual(plain_words.excesses(rates, limits), [])


if __name__ == "__main__":
    unittest.main()
