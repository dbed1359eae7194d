"""Names the wrong argument of a call in one sentence.

A public function becomes a wrapper that has a signature. If a call raises and does not fit this
signature, the wrapper raises a TypeError that names the argument. Otherwise the function's own error
remains. A successful call only passes the wrapper.
"""

import ast
import functools
import inspect
import reprlib

from ._errors import Error

_POSITIONAL = inspect.Parameter.POSITIONAL_OR_KEYWORD
_KEYWORD = inspect.Parameter.KEYWORD_ONLY
_OPTIONS = inspect.Parameter.VAR_KEYWORD
_SHOWN = 60  # Characters of a value in a message.


def checked(function, name, options=None):
    """Returns a wrapper of `function`, called `name`, with its documentation.

    name: with its class, such as "Stream.send".
    options: the names that `function` accepts as **options; any name if None.
    """
    signature, text = _described(function)
    label = name.removesuffix(".__init__")
    if "." in name:
        signature = _with_self(signature)
    if options is not None:
        signature = _with_options(signature, options)

    @functools.wraps(function, assigned=())
    def call(*args, **kwargs):
        try:
            return function(*args, **kwargs)
        except (TypeError, Error):
            fault = _fault(label, signature, args, kwargs)
            if fault is None:
                raise
        raise TypeError(fault)

    call.__doc__, call.__signature__, call.__module__ = text, signature, __package__
    call.__name__, call.__qualname__ = name.rpartition(".")[2], name
    return call


def shorten(value):
    """One line with the beginning of repr(value), for messages."""
    text = " ".join(reprlib.repr(value).split())
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "..."


def _described(function):
    """The signature of `function` and its documentation."""
    if inspect.isfunction(function):
        return inspect.signature(function), function.__doc__
    # pybind11 writes the signature of a native function into the first line of its documentation.
    line, _, text = function.__doc__.partition("\n")
    arguments = ast.parse(f"def {line}: ...").body[0].args
    missing = [inspect.Parameter.empty] * (len(arguments.args) - len(arguments.defaults))
    defaults = missing + [ast.literal_eval(value) for value in arguments.defaults]
    parameters = [inspect.Parameter(each.arg, _POSITIONAL, default=default)
                  for each, default in zip(arguments.args, defaults)]
    parameters += [inspect.Parameter(each.arg, _KEYWORD, default=ast.literal_eval(default))
                   for each, default in zip(arguments.kwonlyargs, arguments.kw_defaults)]
    if arguments.kwarg is not None:
        parameters.append(inspect.Parameter(arguments.kwarg.arg, _OPTIONS))
    return inspect.Signature(parameters), text.strip()


def _with_self(signature):
    """`signature` of a method, with `self` as the name of the first parameter."""
    first, *others = signature.parameters.values()
    return signature.replace(parameters=[first.replace(name="self"), *others])


def _with_options(signature, names):
    """`signature` with keyword arguments instead of **options. Names that begin with _ are private."""
    kept = [each for each in signature.parameters.values() if each.kind is not _OPTIONS]
    kept += [inspect.Parameter(name, _KEYWORD, default=None) for name in names
             if not name.startswith("_")]
    return signature.replace(parameters=kept)


def _fault(label, signature, args, kwargs):
    """What is wrong with the arguments of a call, in one sentence; None if they fit."""
    parameters = signature.parameters.values()
    known = [each.name for each in parameters if each.name != "self"]
    if not any(each.kind is _OPTIONS for each in parameters):
        for given in kwargs:
            if given not in known and not given.startswith("_"):
                return f"unknown argument {given!r} of {label}(){_nearest(given, known, kwargs)}"
    own = "self" in signature.parameters
    owner = label.partition(".")[0]
    if own and args and owner not in [each.__name__ for each in type(args[0]).__mro__]:
        return f"{label}() must be called on a {owner}, not on a {type(args[0]).__name__}"
    allowed = sum(each.kind is _POSITIONAL for each in parameters) - own
    if len(args) - own > allowed:
        by_name = any(each.kind is _KEYWORD for each in parameters)
        return (f"{label}() takes {allowed} positional argument{'s' * (allowed != 1)}, not "
                f"{len(args) - own}{': pass the others by name' if by_name else ''}")
    try:
        signature.bind(*args, **{key: value for key, value in kwargs.items()
                                   if not key.startswith("_")})
    except TypeError as error:
        return f"{label}(): {error}"
    return None


def _nearest(given, known, used):
    import difflib

    near = difflib.get_close_matches(given.lower(), known, 1)
    return f"; did you mean {near[0]!r}?" if near and near[0] not in used else ""
