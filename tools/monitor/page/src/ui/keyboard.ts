/** Keys of the page. They are listed in the help dialog. */

/** What keys do, by KeyboardEvent.key with "Shift+" before it where that matters. */
export type KeyMap = Record<string, () => void>;

/** Elements that take keys themselves. */
function takesText(target: EventTarget | null): boolean {
  return (
    target instanceof HTMLElement && (target.isContentEditable || /^(INPUT|TEXTAREA|SELECT)$/.test(target.tagName))
  );
}

/** The name of a key in a KeyMap. */
export function keyName(event: { key: string; shiftKey: boolean }): string {
  const key = event.key === ' ' ? 'Space' : event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const named = key.length > 1;
  return event.shiftKey && named ? `Shift+${key}` : key;
}

export function listenForKeys(keys: KeyMap): void {
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector('dialog[open]')) return;
    const slider = event.target instanceof HTMLInputElement && event.target.type === 'range';
    if (takesText(event.target) && !slider) return;
    const name = keyName(event);
    // A button in focus is pressed by the space bar as everywhere.
    if (name === 'Space' && event.target instanceof HTMLButtonElement) return;
    const action = keys[name];
    if (!action) return;
    event.preventDefault();
    action();
  });
}
