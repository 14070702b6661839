import { LitElement, css, html, svg } from "lit";
import { customElement, property } from "lit/decorators.js";

import type { Playback } from "../common/playback";
import { PlaybackController } from "../common/playback-controller";
import { sharedStyles } from "../common/shared-styles";

const RATES = [0.25, 0.5, 1, 2];
const PLAY = svg`<path d="M5 3.2v9.6L13 8z" />`;
const PAUSE = svg`<path d="M4 3h3v10H4zM9 3h3v10H9z" />`;

/** Play, pause, scrub and speed for the page's clock. */
@customElement("ec-transport")
export class EcTransport extends LitElement {
  @property({ attribute: false }) playback: Playback | null = null;

  constructor() {
    super();
    new PlaybackController(
      this,
      () => this.playback,
      () => this.requestUpdate(),
    );
  }

  static override styles = [
    sharedStyles,
    css`
      :host {
        display: flex;
        align-items: center;
        gap: 0.6rem;
      }
      button {
        width: 2.2rem;
        height: 2.2rem;
        padding: 0;
        border-radius: 50%;
        display: grid;
        place-items: center;
        background: var(--accent);
        border-color: var(--accent);
        flex: none;
      }
      svg {
        width: 1rem;
        fill: var(--on-accent);
      }
      input {
        flex: 1;
        min-width: 4rem;
        accent-color: var(--accent);
      }
      output {
        min-width: 6.6rem;
        text-align: right;
      }
      select {
        border: none;
        background: none;
        padding: 0;
        color: var(--ink-soft);
      }
    `,
  ];

  override render() {
    const clock = this.playback;
    if (!clock) return html``;
    return html`
      <button
        @click=${() => clock.toggle()}
        aria-label=${clock.playing ? "Pause" : "Play"}
        title="${clock.playing ? "Pause" : "Play"} (space or k)"
        ?disabled=${clock.duration <= 0}
      >
        <svg viewBox="0 0 16 16" aria-hidden="true">${clock.playing ? PAUSE : PLAY}</svg>
      </button>
      <input
        type="range"
        aria-label="Time"
        aria-valuetext="${clock.time.toFixed(2)} seconds"
        min=${clock.start}
        max=${clock.end}
        step="0.01"
        .value=${String(clock.time)}
        @input=${(event: Event) => {
          clock.pause();
          clock.seek(Number((event.target as HTMLInputElement).value));
        }}
      />
      <output class="number small"
        >${clock.time.toFixed(2)} <span class="soft">/ ${clock.end.toFixed(2)} s</span></output
      >
      <select
        aria-label="Speed"
        class="small"
        @change=${(event: Event) => {
          clock.rate = Number((event.target as HTMLSelectElement).value);
        }}
      >
        ${RATES.map(
          (rate) => html`<option value=${rate} ?selected=${rate === clock.rate}>${rate}×</option>`,
        )}
      </select>
    `;
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-transport": EcTransport;
  }
}
