// The page of the preview: a robot, and the roles that its modules take.

/** What the server says of a document (tools/lsp/preview.h). */
export interface Preview {
  robots: string[];
  robot: string;
  svg: string;
  complete: boolean;
  modules?: { module: string; role: string; color: string }[];
}

/** A text as HTML. */
export function escapeHtml(text: string): string {
  return text.replace(/[&<>"']/g, (c) => `&#${c.charCodeAt(0)};`);
}

/** The body of the page. It holds no script of the document: names are texts, the picture is the server's own. */
export function previewBody(preview: Preview): string {
  const choice = preview.robots
    .map((name) => `<option${name === preview.robot ? ' selected' : ''}>${escapeHtml(name)}</option>`)
    .join('');
  const parts: string[] = [];
  if (preview.robots.length > 0) parts.push(`<label>Robot <select id="robot">${choice}</select></label>`);
  // An image shows the picture and runs nothing in it.
  if (preview.svg !== '') {
    const data = Buffer.from(preview.svg).toString('base64');
    parts.push(`<p><img alt="${escapeHtml(preview.robot)}" src="data:image/svg+xml;base64,${data}"></p>`);
  }
  if (preview.modules !== undefined) parts.push(roleTable(preview.modules));
  if (!preview.complete) parts.push('<p class="quiet">Other robots are being asked.</p>');
  if (preview.svg === '' && preview.complete) parts.push(`<p class="quiet">${nothing(preview)}</p>`);
  return parts.join('\n');
}

function nothing(preview: Preview): string {
  return preview.modules === undefined
    ? 'There is nothing to show yet: a module with a shape, or a robot.'
    : 'No robot of the models beside the program has a module that takes one of its roles. The setting <code>morphbus.models</code> names others.';
}

function roleTable(modules: NonNullable<Preview['modules']>): string {
  if (modules.length === 0) return '';
  const rows = modules.map(
    (one) =>
      `<tr><td>${escapeHtml(one.module)}</td><td><span class="color" style="background:${escapeHtml(one.color)}"></span>` +
      `${one.role === '' ? '<span class="quiet">none</span>' : escapeHtml(one.role)}</td></tr>`,
  );
  return `<table><tr><th>module</th><th>role</th></tr>${rows.join('')}</table>`;
}

/** The whole page. Only the script that is marked with `nonce` may run. */
export function previewPage(preview: Preview, nonce: string): string {
  return `<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'nonce-${nonce}'">
<style>
body { font-family: var(--vscode-font-family, sans-serif); padding: 0.5rem 1rem; }
img { max-width: 100%; background: #fff; border-radius: 4px; }
table { border-collapse: collapse; } th, td { text-align: left; padding: 0.15rem 0.8rem 0.15rem 0; }
.color { display: inline-block; width: 0.8em; height: 0.8em; border-radius: 2px; margin-right: 0.4em; }
.quiet { opacity: 0.7; }
</style></head><body>
${previewBody(preview)}
<script nonce="${nonce}">
const vscode = acquireVsCodeApi();
document.getElementById('robot')?.addEventListener('change', (event) => vscode.postMessage({ robot: event.target.value }));
</script></body></html>`;
}
