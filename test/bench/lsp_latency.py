#!/usr/bin/env python3
"""How long an editor waits for `morphbus lsp`: each question on the largest files that ship, right after a key was pressed, and
pointing at every third line. The goal is 50 ms. Prints the slowest answer of each kind; status 1 if one took longer.

Usage: lsp_latency.py [BIN_FOLDER]     (default build/release/bin)
"""
import os
import pathlib
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
os.environ.setdefault('MORPHBUS_BIN', sys.argv[1] if len(sys.argv) > 1 else str(ROOT / 'build' / 'release' / 'bin'))
os.environ.setdefault('MORPHBUS_SOURCE', str(ROOT))
os.environ.setdefault('MORPHBUS_SCRATCH', '/tmp')
sys.path.insert(0, str(ROOT / 'test' / 'e2e'))
from lsp_client import MODELS, Editor  # noqa: E402

GOAL_MS = 50
FILES = ('mtran.m3l', 'atron.m3l', 'snakes.m3l', 'programs/quadruped_tuned.dyn', 'programs/quadruped_steered.dyn')
QUESTIONS = ('hover', 'completion', 'signatureHelp', 'definition', 'references', 'documentHighlight', 'documentSymbol', 'formatting',
             'inlayHint', 'codeAction')


def main():
    editor = Editor(MODELS)
    slowest = 0.0
    for name in FILES:
        uri = editor.open(MODELS / name)
        editor.diagnostics(uri)
        text, worst = editor.texts[uri], {}

        def ask(method, line, character):
            parameters = {'textDocument': {'uri': uri}, 'position': {'line': line, 'character': character}, 'options': {},
                          'range': editor.whole(uri), 'context': {'includeDeclaration': True, 'diagnostics': []}}
            began = time.perf_counter()
            editor.ask('textDocument/' + method, parameters)
            worst[method] = max(worst.get(method, 0.0), (time.perf_counter() - began) * 1e3)

        for i, method in enumerate(QUESTIONS):
            # A key is pressed, so that everything has to be worked out anew for the first answer.
            at = len(text) // 2 + 7 * i
            editor.replace(uri, text[:at] + ' ' + text[at:], 2 + i)
            ask(method, text[:at].count('\n'), 4)
        editor.replace(uri, text, 99)
        for line, content in enumerate(text.split('\n')):
            for character in range(0, len(content) if line % 3 == 0 else 0, 9):
                ask('hover', line, character)
        print(f'{name} ({len(text)} bytes): ' + ', '.join(f'{method} {ms:.1f} ms' for method, ms in worst.items()))
        slowest = max(slowest, *worst.values())
    editor.close()
    print(f'slowest {slowest:.1f} ms, goal {GOAL_MS} ms')
    return 0 if slowest <= GOAL_MS else 1


if __name__ == '__main__':
    sys.exit(main())
