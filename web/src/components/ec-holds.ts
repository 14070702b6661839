import { LitElement, css, html, nothing } from "lit";
import { customElement, property } from "lit/decorators.js";

import { definitionWords, fixed, span, splitWords } from "../common/estimate-words";
import type { Playback } from "../common/playback";
import { sharedStyles } from "../common/shared-styles";
import type { Hold } from "../data/estimate-types";

/** What the hands bore, hold by hold: the mass with its band by each definition, and whose it was. */
@customElement("ec-holds")
export class EcHolds extends LitElement {
  @property({ attribute: false }) holds: Hold[] = [];
  @property({ attribute: false }) playback: Playback | null = null;

  static override styles = [
    sharedStyles,
    css`
      :host {
        display: block;
      }
      button {
        display: grid;
        grid-template-columns: 1fr auto;
        gap: 0 0.6rem;
        align-items: baseline;
        width: 100%;
        text-align: left;
        border: none;
        border-bottom: 1px solid var(--line);
        border-radius: 0;
        background: none;
        padding: 0.35rem 0.5rem;
      }
      li:last-child button {
        border-bottom: none;
      }
      button:hover {
        background: var(--sunken);
      }
      b {
        font-weight: 620;
      }
      .free b {
        font-weight: 400;
      }
      .tag {
        justify-self: end;
      }
      .wide {
        grid-column: 1 / -1;
      }
    `,
  ];

  override render() {
    if (this.holds.length === 0) {
      return html`<p class="soft small">None long enough to be weighed.</p>`;
    }
    return html`<ol>
      ${this.holds.map((hold) => this.#item(hold))}
    </ol>`;
  }

  #item(hold: Hold) {
    const loaded = hold.state === "loaded";
    const own = Object.keys(hold.by_definition_kg)[0] ?? "";
    const others = Object.entries(hold.by_definition_kg).slice(1);
    const split = splitWords(hold);
    return html`<li>
      <button
        class=${hold.state}
        title="Go to ${hold.start_s.toFixed(2)} s"
        @click=${() => {
          this.playback?.pause();
          this.playback?.seek(hold.start_s);
        }}
      >
        <span class="number soft">${hold.start_s.toFixed(1)}–${hold.end_s.toFixed(1)} s</span>
        <span class="tag">${hold.state}</span>
        <b class="number">${fixed(hold.mass_kg.p50)} kg</b>
        <span class="number small soft">${span(hold.mass_kg)}</span>
        ${loaded && split ? html`<span class="wide small">${split}</span>` : nothing}
        ${
          loaded
            ? html`<span class="wide small soft number" title=${definitionWords(own)}
                >${own};
                ${others.map(([name, mass], index) => html`${index > 0 ? "; " : ""}<span title=${definitionWords(name)}>${name} ${fixed(mass.p50)} (${span(mass)})</span>`)}</span
              >`
            : nothing
        }
      </button>
    </li>`;
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-holds": EcHolds;
  }
}
