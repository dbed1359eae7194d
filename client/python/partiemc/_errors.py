import sys
import warnings


class Error(Exception):
    """An error of PartiEMC: a refused argument or frame, or a failed stream.

    code: gRPC status code: "INVALID_ARGUMENT", "UNAVAILABLE", ...
    reason: for programs: "NOT_FINITE", "COUNT", ...; "" if no rule was broken. proto/PROTOCOL.md
        lists them. An error with a reason refuses one frame, and its stream continues. An error
        without a reason has ended the stream.
    field, value, rule: for example "positions[17].x", "nan", "must be finite".
    sequence: number of the frame that a server has refused; otherwise 0.
    """

    def __init__(self, message, code="INTERNAL", reason="", field="", value="", rule="", sequence=0):
        super().__init__(message)
        self.code = code
        self.reason = reason
        self.field = field
        self.value = value
        self.rule = rule
        self.sequence = sequence

    def __reduce__(self):
        return type(self), (str(self), self.code, self.reason, self.field, self.value, self.rule,
                            self.sequence)


class PartiemcWarning(UserWarning):
    """A doubt: suspicious but legal input. README.md lists the kinds.

    Each Reconstructor, Stream and Watch warns once of each kind; Result.doubts has the names in every
    frame.

    result: the Result of the frame, if the warning is raised as an error; otherwise None.
    """

    def __init__(self, message):
        super().__init__(message)
        self.result = None


def warn(text, result):
    """Warns at the line of the caller outside of this package. An error carries `result`."""
    frame, level = sys._getframe().f_back, 2  # No frame if a thread began with a method of this package.
    while frame and frame.f_back and frame.f_globals.get("__package__") == __package__:
        frame, level = frame.f_back, level + 1
    try:
        warnings.warn(text, PartiemcWarning, stacklevel=level)
    except PartiemcWarning as raised:
        raised.result = result
        raise
