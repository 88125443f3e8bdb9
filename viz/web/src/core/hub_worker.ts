// The shared worker of all pages of a browser that show this viewer.
import { Hub } from "#core/hub.ts";

const hub = new Hub({ isShared: true });
self.addEventListener("connect", (event) => hub.add((event as MessageEvent).ports[0]));
