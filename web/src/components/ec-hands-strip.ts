import { LitElement, css, html } from "lit";
import { customElement, property } from "lit/decorators.js";

import { sharedStyles } from "../common/shared-styles";
import type { HandsStretch } from "../data/estimate-types";

const ROWS = [
  { key: "together", label: "both" },
  { key: "right", label: "right" },
  { key: "left", label: "left" },
] as const;

/** Whether each hand was free or loaded over time, in line with the charts above and below. */
@customElement("ec-hands-strip")
export class EcHandsStrip extends LitElement {
  @property({ attribute: false }) stretches: HandsStretch[] = [];

  static override styles = [
    sharedStyles,
    css`
      :host {
        display: block;
        font-size: 0.79rem;
      }
      .row {
        display: flex;
        align-items: center;
        height: 1.05rem;
      }
      .row > span {
        width: 42px;
        margin-right: 6px;
        text-align: right;
        color: var(--ink-soft);
        flex: none;
      }
      .bar {
        position: relative;
        flex: 1;
        height: 0.72rem;
        margin-right: 8px;
        background: var(--sunken);
        border-radius: 2px;
        overflow: hidden;
      }
      .bar i {
        position: absolute;
        top: 0;
        bottom: 0;
      }
      .loaded {
        background: var(--part-2);
      }
      .unknown {
        background: repeating-linear-gradient(-45deg, var(--line) 0 2px, var(--surface) 2px 6px);
      }
      .key {
        display: flex;
        gap: 0.9rem;
        margin-left: 48px;
        color: var(--ink-soft);
      }
      .key i {
        display: inline-block;
        width: 0.9rem;
        height: 0.6rem;
        margin-right: 0.3rem;
        border-radius: 2px;
      }
      .key .free {
        background: var(--sunken);
        border: 1px solid var(--line);
      }
    `,
  ];

  override render() {
    const start = this.stretches[0]?.start_s ?? 0;
    const end = this.stretches[this.stretches.length - 1]?.end_s ?? 1;
    const place = (time: number) => (100 * (time - start)) / Math.max(1e-9, end - start);
    return html`
      ${ROWS.map(
        (row) =>
          html`<div class="row">
            <span aria-hidden="true">${row.label}</span>
            <div class="bar" role="img" aria-label=${this.#words(row.key)}>
              ${this.stretches.map((one, index) => {
                const next = this.stretches[index + 1]?.start_s ?? one.end_s;
                const from = place(one.start_s);
                return html`<i
                  class=${one[row.key]}
                  title="${row.label}: ${one[row.key]}, ${one.start_s.toFixed(1)}–${one.end_s.toFixed(1)} s"
                  .style=${`left: ${from}%; width: ${place(next) - from}%`}
                ></i>`;
              })}
            </div>
          </div>`,
      )}
      <div class="key" aria-hidden="true">
        <span><i class="free"></i>free</span><span><i class="loaded"></i>loaded</span>
        <span><i class="unknown"></i>cannot be told</span>
      </div>
    `;
  }

  #words(key: (typeof ROWS)[number]["key"]): string {
    const who = key === "together" ? "Both hands together" : `The ${key} hand`;
    const parts: string[] = [];
    let since = 0;
    for (const [index, one] of this.stretches.entries()) {
      const first = this.stretches[since]!;
      const next = this.stretches[index + 1];
      if (next && next[key] === one[key]) continue;
      parts.push(`${one[key]} ${first.start_s.toFixed(1)} to ${one.end_s.toFixed(1)} s`);
      since = index + 1;
    }
    return `${who}: ${parts.join(", ")}`;
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-hands-strip": EcHandsStrip;
  }
}
