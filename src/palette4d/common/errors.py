"""The errors of palette4d: each says what was found, what was expected and what to do."""


class Palette4dError(Exception):
    """Something in the input or the environment that the user can mend.

    The command line prints it as ``palette4d: error: …`` and exits with 1.
    """


class WriteError(Palette4dError):
    """A file that cannot be written where it should be: no permission, or no room."""


class SidecarError(Palette4dError):
    """An unusable sidecar; `str()` is "FILE: POINTER: found X, expected Y".

    Attributes
    ----------
    file : str
        The file, or the name that stands for it.
    pointer : str
        JSON pointer (RFC 6901) of the offending value; "" is the whole document.
    found, expected : str
        What is there, and what should be.
    """

    def __init__(self, file: str, pointer: str, found: str, expected: str) -> None:
        """Keep the four parts, also as `args`: that makes the error picklable."""
        super().__init__(file, pointer, found, expected)
        self.file = file
        self.pointer = pointer
        self.found = found
        self.expected = expected

    def __str__(self) -> str:
        """Return "FILE: POINTER: found X, expected Y", without the parts that are empty."""
        parts = [part for part in (self.file, self.pointer) if part]
        return ": ".join([*parts, f"found {self.found}, expected {self.expected}"])
