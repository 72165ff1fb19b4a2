"""What the package says when it is given something that it cannot use."""


class InputError(ValueError):
    """Bad input, in one sentence: what was given, what was expected, what exists.

    The message is kept on one line, whatever the text that is quoted in it.
    """

    def __init__(self, message: str):
        super().__init__(" ".join(message.split()))
