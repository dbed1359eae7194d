class Error(Exception):
    """What PartiEMC refuses or cannot do.

    code: "INVALID_ARGUMENT", "UNAVAILABLE", ...: as gRPC names them.
    reason: for programs: "NOT_FINITE", "COUNT", ...; "" where no rule was broken. proto/PROTOCOL.md
        lists them. With a reason, a stream refuses one frame and goes on; without, it has ended.
    field, value, rule: what broke which rule, as "positions[17].x", "nan", "must be finite".
    sequence: the number of the frame that a server has refused; else 0.
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
