// morphbus lsp through vscode-languageserver-protocol, the library that editors use: every message of a session is one that it
// understands, and texts that are broken in hundreds of ways are answered like any other.
import assert from 'node:assert/strict';
import { spawn, execFileSync } from 'node:child_process';
import { mkdtempSync, readdirSync, readFileSync, rmSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { pathToFileURL } from 'node:url';

const { MORPHBUS_BIN, MORPHBUS_SOURCE, MORPHBUS_EDITOR_WORK, MORPHBUS_VSIX } = process.env;
const require = createRequire(join(MORPHBUS_EDITOR_WORK, 'package.json'));
const lsp = require('vscode-languageserver-protocol/node');

let server, connection;
const diagnostics = new Map();
const waiting = [];

before(async () => {
  server = spawn(join(MORPHBUS_BIN, 'morphbus'), ['lsp'], { stdio: ['pipe', 'pipe', 'inherit'] });
  connection = lsp.createProtocolConnection(new lsp.StreamMessageReader(server.stdout), new lsp.StreamMessageWriter(server.stdin));
  connection.onNotification(lsp.PublishDiagnosticsNotification.type, (note) => {
    diagnostics.set(note.uri, note);
    waiting.forEach((look) => look());
  });
  connection.listen();
  const answer = await connection.sendRequest(lsp.InitializeRequest.type, {
    processId: process.pid,
    rootUri: null,
    workspaceFolders: [{ uri: pathToFileURL(join(MORPHBUS_SOURCE, 'models')).href, name: 'models' }],
    capabilities: { textDocument: { hover: { contentFormat: ['markdown'] } } },
  });
  assert.equal(answer.capabilities.textDocumentSync.change, lsp.TextDocumentSyncKind.Incremental);
  await connection.sendNotification(lsp.InitializedNotification.type, {});
});

after(async () => {
  await connection.sendRequest(lsp.ShutdownRequest.type);
  await connection.sendNotification(lsp.ExitNotification.type);
  const status = await new Promise((done) => server.on('exit', done));
  assert.equal(status, 0);
});

function open(path, text = readFileSync(path, 'utf8')) {
  const uri = pathToFileURL(path).href;
  const languageId = path.endsWith('.m3l') ? 'm3l' : 'dynarole';
  diagnostics.delete(uri);
  connection.sendNotification(lsp.DidOpenTextDocumentNotification.type, { textDocument: { uri, languageId, version: 1, text } });
  return uri;
}

function close(uri) {
  return connection.sendNotification(lsp.DidCloseTextDocumentNotification.type, { textDocument: { uri } });
}

async function diagnosticsOf(uri) {
  while (!diagnostics.has(uri)) await new Promise((done) => waiting.push(done));
  waiting.length = 0;
  return diagnostics.get(uri).diagnostics;
}

function at(text, place) {
  const offset = text.indexOf(place.replace('|', '')) + place.indexOf('|');
  const before = text.slice(0, offset).split('\n');
  return { line: before.length - 1, character: before.at(-1).length };
}

// Everything that can be asked about one place.
const QUESTIONS = [
  lsp.HoverRequest.type, lsp.CompletionRequest.type, lsp.SignatureHelpRequest.type, lsp.DefinitionRequest.type,
  lsp.DocumentHighlightRequest.type,
];

test('a model and a program are answered in the forms of the protocol', async () => {
  const path = join(MORPHBUS_SOURCE, 'models', 'mtran.m3l');
  const text = readFileSync(path, 'utf8');
  const uri = open(path);
  assert.deepEqual(await diagnosticsOf(uri), []);
  const place = { textDocument: { uri }, position: at(text, '(m3.c6, m5.c3, |3)') };
  const hover = await connection.sendRequest(lsp.HoverRequest.type, place);
  assert.ok(lsp.Hover.is(hover));
  assert.match(hover.contents.value, /connection MTRAN_to_MTRAN:3/);
  const symbols = await connection.sendRequest(lsp.DocumentSymbolRequest.type, { textDocument: { uri } });
  assert.ok(symbols.length > 3 && symbols.every((symbol) => lsp.DocumentSymbol.is(symbol)));
  const whole = { start: { line: 0, character: 0 }, end: { line: 9999, character: 0 } };
  const hints = await connection.sendRequest(lsp.InlayHintRequest.type, { textDocument: { uri }, range: whole });
  assert.ok(hints.length > 5 && hints.every((hint) => lsp.InlayHint.is(hint)));
  const edit = await connection.sendRequest(lsp.RenameRequest.type, {
    textDocument: { uri }, position: at(text, 'link |connecting_bar'), newName: 'strut',
  });
  assert.ok(lsp.WorkspaceEdit.is(edit) && Object.keys(edit.changes).length > 1);
  const items = await connection.sendRequest(lsp.CompletionRequest.type, { textDocument: { uri }, position: at(text, 'joint joint_1: |type') });
  assert.ok(items.some((item) => item.label === 'torque'));
  await assert.rejects(
    connection.sendRequest(lsp.RenameRequest.type, { textDocument: { uri }, position: at(text, 'link |connecting_bar'), newName: '1' }),
    (error) => error instanceof lsp.ResponseError && error.code === lsp.LSPErrorCodes.RequestFailed,
  );
  await close(uri);
});

for (const [language, ending] of [['m3l', '.m3l'], ['dynarole', '.dyn']]) {
  test(`texts of ${language} that are broken in all ways of the corpus`, async () => {
    const folder = join(MORPHBUS_SOURCE, 'test', 'malformed', language);
    const names = readdirSync(folder).filter((name) => name.endsWith(ending));
    assert.ok(names.length >= 50, `${names.length} texts`);
    for (const name of names) {
      const bytes = readFileSync(join(folder, name));
      const text = bytes.toString('utf8');
      const uri = open(join(folder, name), text);
      const found = await diagnosticsOf(uri);
      assert.ok(found.every((one) => lsp.Diagnostic.is(one)), name);
      const lines = text.split('\n');
      // Every so often a place, and the very last one.
      for (let i = 0; i <= 8; ++i) {
        const line = Math.floor(((lines.length - 1) * i) / 8);
        const position = { line, character: Math.floor(lines[line].length / 2) };
        for (const question of QUESTIONS) await connection.sendRequest(question, { textDocument: { uri }, position });
      }
      await connection.sendRequest(lsp.DocumentSymbolRequest.type, { textDocument: { uri } });
      await connection.sendRequest(lsp.DocumentFormattingRequest.type, { textDocument: { uri }, options: { tabSize: 2, insertSpaces: true } });
      await close(uri);
    }
  });
}

test('the extension is a zip with all that its manifest names', () => {
  const list = execFileSync('python3', ['-m', 'zipfile', '-l', MORPHBUS_VSIX], { encoding: 'utf8' });
  const folder = mkdtempSync(join(tmpdir(), 'morphbus-vsix-'));
  try {
    execFileSync('python3', ['-m', 'zipfile', '-e', MORPHBUS_VSIX, folder]);
    const extension = join(folder, 'extension');
    const manifest = JSON.parse(readFileSync(join(extension, 'package.json'), 'utf8'));
    const named = [
      manifest.main,
      ...manifest.contributes.languages.map((one) => one.configuration),
      ...manifest.contributes.grammars.map((one) => one.path),
    ];
    for (const name of named) assert.ok(readFileSync(join(extension, name)).length > 0, name);
    assert.match(readFileSync(join(folder, 'extension.vsixmanifest'), 'utf8'), /Id="morphbus-languages"/);
    assert.match(list, /\[Content_Types\]\.xml/);
    // The script needs nothing but what an editor gives it.
    const script = readFileSync(join(extension, 'extension.js'), 'utf8');
    const needs = [...script.matchAll(/require\("([^"]+)"\)/g)].map((match) => match[1]);
    const builtin = new Set(require('node:module').builtinModules);
    assert.deepEqual(needs.filter((name) => name !== 'vscode' && !builtin.has(name.replace('node:', ''))), []);
  } finally {
    rmSync(folder, { recursive: true });
  }
});

test('the page of the preview shows names as text, and runs one script', async () => {
  const { previewPage } = await import(pathToFileURL(join(MORPHBUS_EDITOR_WORK, 'preview_page.mjs')).href);
  const preview = {
    robots: ['a', '<img src=x>'], robot: 'a', svg: '<svg></svg>', complete: false,
    modules: [{ module: 'm1', role: '', color: '#123456' }, { module: 'm2', role: 'Head', color: '#654321' }],
  };
  const page = previewPage(preview, 'secret');
  assert.ok(!page.includes('<img src=x>'));
  assert.match(page, /script-src 'nonce-secret'/);
  assert.equal(page.split('<script').length, 2);
  assert.match(page, /Head/);
  assert.match(page, /Other robots are being asked/);
  assert.match(previewPage({ robots: [], robot: '', svg: '', complete: true }, 'n'), /nothing to show yet/);
});
