"""What ends the program with a message: its exit code, as those of tagrid."""

USAGE, WORLD = 64, 74


class Failure(Exception):
    def __init__(self, code, message):
        super().__init__(message)
        self.code = code
