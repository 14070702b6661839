import type { ReactiveController, ReactiveControllerHost } from "lit";

import type { Playback } from "./playback";

/** Calls back on every change of the page's clock while its element is on the page. */
export class PlaybackController implements ReactiveController {
  constructor(
    host: ReactiveControllerHost,
    private readonly playback: () => Playback | null,
    private readonly onChange: () => void,
  ) {
    host.addController(this);
  }

  #subscribed: Playback | null = null;

  hostConnected(): void {
    this.#follow(this.playback());
  }

  hostUpdate(): void {
    this.#follow(this.playback());
  }

  hostDisconnected(): void {
    this.#follow(null);
  }

  #follow(playback: Playback | null): void {
    if (playback === this.#subscribed) return;
    this.#subscribed?.removeEventListener("change", this.onChange);
    playback?.addEventListener("change", this.onChange);
    this.#subscribed = playback;
  }
}
