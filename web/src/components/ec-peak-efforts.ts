import { LitElement, css, html } from "lit";
import { customElement, property } from "lit/decorators.js";

import { span } from "../common/estimate-words";
import { figure, seconds } from "../common/format";
import { jointWords } from "../common/names";
import type { Playback } from "../common/playback";
import { sharedStyles } from "../common/shared-styles";
import { tableStyles } from "../common/table-styles";
import type { PeakEffort } from "../data/estimate-types";

/**
 * The greatest effort of each joint and when it was, greatest first.
 *
 * @fires joint-select `detail` is the joint; the clock has been set to its peak already.
 */
@customElement("ec-peak-efforts")
export class EcPeakEfforts extends LitElement {
  @property({ attribute: false }) efforts: PeakEffort[] = [];
  @property({ attribute: false }) playback: Playback | null = null;

  static override styles = [
    sharedStyles,
    tableStyles,
    css`
      button {
        min-height: 0;
        border: none;
        background: none;
        padding: 0;
        text-align: left;
        text-decoration: underline;
        text-decoration-color: var(--line);
        text-underline-offset: 0.2em;
      }
      th,
      td {
        padding: 0.22rem 0 0.22rem 0.6rem;
      }
      td:last-child,
      .band {
        white-space: nowrap;
      }
    `,
  ];

  override render() {
    if (this.efforts.length === 0) return html`<p class="soft small">None can be told.</p>`;
    return html`<table class="number small">
      <thead>
        <tr>
          <th>Joint</th>
          <th>Most</th>
          <th>5–95 %</th>
          <th>at</th>
        </tr>
      </thead>
      <tbody>
        ${this.efforts.map(
          (one) =>
            html`<tr>
              <td>
                <button @click=${() => this.#go(one)}>${jointWords(one.joint)}</button>
              </td>
              <td>${figure(one.peak_nm.p50)}</td>
              <td class="soft band">${span(one.peak_nm, 0)}</td>
              <td>${seconds(one.at_s, 1)}</td>
            </tr>`,
        )}
      </tbody>
    </table>`;
  }

  #go(one: PeakEffort): void {
    this.playback?.pause();
    this.playback?.seek(one.at_s);
    this.dispatchEvent(
      new CustomEvent("joint-select", { detail: one.joint, bubbles: true, composed: true }),
    );
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-peak-efforts": EcPeakEfforts;
  }
}
