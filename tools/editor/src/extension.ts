// The extension for Visual Studio Code: it starts `morphbus lsp`, which knows the languages, and shows what that says of the
// robot and the roles of the text that is edited.
import { randomBytes } from 'node:crypto';
import * as vscode from 'vscode';
import { LanguageClient, type LanguageClientOptions, type ServerOptions } from 'vscode-languageclient/node';
import { previewPage, type Preview } from './preview_page.js';

const LANGUAGES = ['m3l', 'dynarole'];

let client: LanguageClient | undefined;
let panel: PreviewPanel | undefined;

async function startClient(): Promise<void> {
  const settings = vscode.workspace.getConfiguration('morphbus');
  const server: ServerOptions = { command: settings.get('path', 'morphbus'), args: ['lsp'] };
  const options: LanguageClientOptions = {
    documentSelector: LANGUAGES.map((language) => ({ language })),
    initializationOptions: { models: settings.get('models', []) },
    synchronize: { configurationSection: 'morphbus' },
  };
  client = new LanguageClient('morphbus', 'Morphbus', server, options);
  client.onNotification('morphbus/rolesKnown', (note: { uri: string }) => panel?.refreshUri(note.uri));
  try {
    await client.start();
  } catch (error) {
    client = undefined;
    const answer = await vscode.window.showErrorMessage(
      `The program morphbus cannot be started: ${error instanceof Error ? error.message : error}`,
      'Settings',
    );
    if (answer === 'Settings') await vscode.commands.executeCommand('workbench.action.openSettings', 'morphbus.path');
  }
}

/** The page beside the text, which follows the text that is edited. */
class PreviewPanel {
  private readonly panel: vscode.WebviewPanel;
  private document: vscode.TextDocument;
  private robot = '';
  private waiting: NodeJS.Timeout | undefined;

  constructor(document: vscode.TextDocument) {
    this.document = document;
    this.panel = vscode.window.createWebviewPanel('morphbus.preview', 'Robot', { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true }, {
      enableScripts: true,
    });
    this.panel.onDidDispose(() => {
      clearTimeout(this.waiting);
      panel = undefined;
    });
    this.panel.webview.onDidReceiveMessage((message: { robot?: string }) => {
      this.robot = message.robot ?? '';
      this.refresh();
    });
    this.refresh();
  }

  /** Shows another text, if it is in one of the languages. */
  follow(document: vscode.TextDocument): void {
    if (!LANGUAGES.includes(document.languageId) || document === this.document) return;
    this.document = document;
    this.robot = '';
    this.refresh();
  }

  /** Asks again, once what comes in quick succession has come. */
  refresh(document: vscode.TextDocument = this.document): void {
    if (document !== this.document) return;
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => void this.show(), 150);
  }

  refreshUri(uri: string): void {
    if (uri === this.document.uri.toString()) this.refresh();
  }

  reveal(): void {
    this.panel.reveal(undefined, true);
  }

  private async show(): Promise<void> {
    if (client === undefined) return;
    const preview = await client.sendRequest<Preview>('morphbus/preview', {
      textDocument: { uri: this.document.uri.toString() },
      robot: this.robot,
    });
    // It may have been closed while the server answered.
    if (panel !== this) return;
    this.panel.title = preview.robot === '' ? 'Robot' : preview.robot;
    this.panel.webview.html = previewPage(preview, randomBytes(16).toString('base64'));
  }
}

export async function activate(context: vscode.ExtensionContext): Promise<void> {
  context.subscriptions.push(
    vscode.commands.registerCommand('morphbus.preview', () => {
      const document = vscode.window.activeTextEditor?.document;
      if (document === undefined || !LANGUAGES.includes(document.languageId)) return;
      if (panel === undefined) {
        panel = new PreviewPanel(document);
      } else {
        panel.follow(document);
        panel.reveal();
      }
    }),
    vscode.commands.registerCommand('morphbus.restart', async () => {
      await client?.stop();
      await startClient();
    }),
    vscode.window.onDidChangeActiveTextEditor((editor) => editor && panel?.follow(editor.document)),
    vscode.workspace.onDidChangeTextDocument((event) => panel?.refresh(event.document)),
  );
  await startClient();
}

export async function deactivate(): Promise<void> {
  await client?.stop();
}
