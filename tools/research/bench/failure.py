"""Errors that a user should read: one line, and the exit codes of tagrid."""

USAGE, BROKEN_INPUT, WORLD = 64, 65, 74


class Failure(Exception):
    def __init__(self, code, text):
        super().__init__(text)
        self.code = code
