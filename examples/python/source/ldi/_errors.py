"""The exceptions of the package."""


class Error(Exception):
    """Base class of ldi's errors: InputError for invalid input, FileError for a file that cannot be read or written.

    code      the kind of error, such as "mismatch" or "file access"
    where     the argument, file or stage
    expected  the valid values
    found     the actual value
    """

    def __init__(self, code, where, expected, found):
        super().__init__(f"{where}: expected {expected}, found {found}")
        self.code, self.where, self.expected, self.found = code, where, expected, found

    def __str__(self):
        return self.args[0]

    def __reduce__(self):
        return type(self), (self.code, self.where, self.expected, self.found)


class InputError(Error, ValueError):
    """An argument or the contents of a file are invalid."""


class FileError(Error, OSError):
    """The system refused to read or write a file."""

    def __init__(self, code, where, expected, found):
        super().__init__(code, where, expected, found)
        self.filename = where


Error.__module__ = InputError.__module__ = FileError.__module__ = "ldi"
