#!/usr/bin/env python3
"""Prints the page of the Python package: what its classes and functions say of themselves, with the types of its stub file.

PYTHONPATH has the package.
"""
import ast
import enum
import inspect
import pathlib

import morphbus
from morphbus import env

STUBS = ast.parse((pathlib.Path(morphbus.__file__).parent / '_core.pyi').read_text(encoding='utf-8'))


def stub_of(name, body=STUBS.body):
    """The definitions of that name in the stub file: several where a function is overloaded."""
    return [node for node in body if getattr(node, 'name', None) == name]


def call_of(name, node):
    """`fk(q: Optional[Sequence[float]] = ...) -> LinkPoses`, without the object itself."""
    arguments = ast.unparse(node.args)
    arguments = arguments.removeprefix('self').removeprefix(', ')
    result = f' -> {ast.unparse(node.returns)}' if node.returns and name != '__init__' else ''
    return f'({arguments}){result}'


def text_of(thing):
    """What it says of itself; compiled functions begin with how they are called, which the stubs say better."""
    text = inspect.getdoc(thing) or ''
    first, _, rest = text.partition('\n')
    name = getattr(thing, '__name__', '')
    return rest.strip() if name and first.startswith(f'{name}(') else text


def show_call(name, calls, text):
    print('```python\n' + '\n'.join(f'{name}{call}' for call in calls) + '\n```\n' + (f'\n{text}\n' if text else ''))


def show_class(cls, scope=STUBS.body):
    print(f'## {cls.__qualname__}\n')
    if hasattr(cls, '__members__') or issubclass(cls, enum.Enum):
        print('One of ' + ', '.join(f'`{name}`' for name in cls.__members__) + '.\n')
        return
    print(f'{inspect.getdoc(cls) or ""}\n')
    body = stub_of(cls.__name__, scope)[0].body if stub_of(cls.__name__, scope) else []
    # What it has, with its type.
    types = {node.target.id: ast.unparse(node.annotation) for node in body if isinstance(node, ast.AnnAssign)}
    texts = {name: inspect.getdoc(thing) or '' for name, thing in vars(cls).items() if isinstance(thing, property)}
    rows = [f'| `{name}` | `{types.get(name, "")}` | {texts.get(name, "")} |'.replace('``', '').replace('\n', ' ')
            for name in sorted(types.keys() | texts.keys()) if not name.startswith('_')]
    if rows:
        print('| attribute | type | |\n|---|---|---|\n' + '\n'.join(rows) + '\n')
    # What it does.
    for name, thing in vars(cls).items():
        if (name.startswith('_') and name != '__init__') or isinstance(thing, property) or inspect.isclass(thing) or not callable(getattr(cls, name)):
            continue
        stubs = stub_of(name, body)
        called = cls.__name__ if name == '__init__' else name
        if stubs:
            show_call(called, [call_of(name, stub) for stub in stubs], text_of(getattr(cls, name)))
        elif inspect.isfunction(thing):
            show_call(called, [str(inspect.signature(thing)).replace('(self, ', '(').replace('(self)', '()')], inspect.getdoc(thing) or '')
    for thing in vars(cls).values():
        if inspect.isclass(thing):
            show_class(thing, body)


def show(module, names):
    for name in names:
        thing = getattr(module, name)
        if inspect.isclass(thing):
            show_class(thing)
        elif stub_of(name):
            print(f'## {name}\n')
            show_call(name, [call_of(name, stub) for stub in stub_of(name)], text_of(thing))
        elif callable(thing):
            print(f'## {name}\n')
            show_call(name, [str(inspect.signature(thing))], text_of(thing))


print('# Python: the package\n\n[From Python](python.md) shows what it is for. Arrays are NumPy\'s, of float64.\n')
show(morphbus, morphbus.__all__)
print(f'## The module env\n\n{inspect.getdoc(env)}\n')
show(env, [name for name in vars(env) if name[0].isupper()])
