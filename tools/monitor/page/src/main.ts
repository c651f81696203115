/** Starts the page in the browser. */

import { App } from './app.ts';
import type { Socket } from './protocol/connection.ts';
import { SUBPROTOCOLS } from './protocol/messages.ts';

/** The server's address: that of the page, with the token of its URL. */
function socketUrl(): string {
  const token = new URLSearchParams(location.search).get('token');
  const scheme = location.protocol === 'https:' ? 'wss:' : 'ws:';
  return `${scheme}//${location.host}/ws${token ? `?token=${encodeURIComponent(token)}` : ''}`;
}

const root = document.getElementById('app');
if (root) {
  const app = new App(root, {
    open: () => new WebSocket(socketUrl(), SUBPROTOCOLS) as unknown as Socket,
    timer: (seconds, action) => {
      const id = setTimeout(action, seconds * 1000);
      return () => clearTimeout(id);
    },
  });
  // For people at the browser's console, and for tests.
  Object.assign(window, { monitor: app });
  app.start();
}
