import { LitElement, css, html, nothing } from "lit";
import { customElement, property } from "lit/decorators.js";

import { momentWords } from "../common/moment-words";
import type { Playback } from "../common/playback";
import { PlaybackController } from "../common/playback-controller";
import { sharedStyles } from "../common/shared-styles";
import type { Moment } from "../data/types";

const NEAR_S = 0.02;

/**
 * The worst instants, one click away.
 *
 * @fires moment-select `detail` is the moment; the clock has been set to it already.
 */
@customElement("ec-moments")
export class EcMoments extends LitElement {
  @property({ attribute: false }) moments: Moment[] = [];
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
        display: block;
      }
      button {
        display: grid;
        grid-template-columns: 1.9rem 3.6rem 1fr;
        gap: 0.5rem;
        align-items: baseline;
        width: 100%;
        text-align: left;
        border: none;
        border-radius: 6px;
        background: none;
        padding: 0.28rem 0.5rem;
        min-height: 0;
      }
      button:hover {
        background: var(--sunken);
      }
      button[aria-current="true"] {
        background: var(--accent-soft);
      }
      .more {
        display: block;
        margin-top: 0.2rem;
      }
      .score {
        font-weight: 620;
        text-align: center;
        border-radius: 5px;
        background: var(--sunken);
      }
      .score.l2 {
        background: var(--zone-2);
      }
      .score.l3 {
        background: var(--zone-3);
      }
      .score.l4 {
        background: var(--zone-4);
      }
    `,
  ];

  override render() {
    if (this.moments.length === 0) return html`<p class="soft small">None to show.</p>`;
    return html`<ol>
      ${this.moments.map((moment) => this.#item(moment))}
    </ol>`;
  }

  #item(moment: Moment) {
    const score = moment.score ?? moment.rula;
    const now = this.playback && Math.abs(this.playback.time - moment.time_s) < NEAR_S;
    const { part, matter, more } = momentWords(moment);
    return html`<li>
      <button aria-current=${now ? "true" : "false"} @click=${() => this.#go(moment)}>
        <span class="score number l${level(score)}" title="RULA score"
          >${score === undefined || score === null ? "–" : figureOfScore(score)}</span
        >
        <span class="number soft">${moment.time_s.toFixed(2)} s</span>
        <span title=${moment.reason ?? nothing}
          >${part ? html`<b>${part}</b> ` : nothing}${matter}${
            now && more.length > 0
              ? html`<span class="more small soft">${more.join("; ")}</span>`
              : nothing
          }</span
        >
      </button>
    </li>`;
  }

  #go(moment: Moment): void {
    this.playback?.pause();
    this.playback?.seek(moment.time_s);
    this.dispatchEvent(
      new CustomEvent("moment-select", { detail: moment, bubbles: true, composed: true }),
    );
  }
}

/** RULA action level of a score. */
const level = (score: number | null | undefined) =>
  score === null || score === undefined ? 1 : score < 3 ? 1 : score < 5 ? 2 : score < 7 ? 3 : 4;

const figureOfScore = (score: number) =>
  Number.isInteger(score) ? String(score) : score.toFixed(1);

declare global {
  interface HTMLElementTagNameMap {
    "ec-moments": EcMoments;
  }
}
