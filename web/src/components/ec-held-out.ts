import { LitElement, css, html, nothing } from "lit";
import { customElement, property } from "lit/decorators.js";

import { percent } from "../common/format";
import { methodWords } from "../common/names";
import { sharedStyles } from "../common/shared-styles";
import { tableStyles } from "../common/table-styles";
import { heldOutRows } from "./held-out-rows";

/** How well each method predicted this person's own motion that it had not seen. */
@customElement("ec-held-out")
export class EcHeldOut extends LitElement {
  @property({ attribute: false }) metrics: Readonly<Record<string, unknown>> | null = null;

  static override styles = [
    sharedStyles,
    tableStyles,
    css`
      h2 {
        margin: 1.1rem 0 0.5rem;
      }
    `,
  ];

  override render() {
    const rows = heldOutRows(this.metrics);
    if (rows.length === 0) return nothing;
    return html`
      <h2>How well they predicted this person</h2>
      <table class="number">
        <thead>
          <tr>
            <th>On motion not trained on</th>
            <th>Joint error</th>
            <th>In the 90 % band</th>
          </tr>
        </thead>
        <tbody>
          ${rows.map(
            (row) =>
              html`<tr>
                <td>${methodWords(row.method)}</td>
                <td>${row.errorDeg === null ? "–" : `${row.errorDeg.toFixed(1)}°`}</td>
                <td>${row.coverage === null ? "–" : percent(row.coverage)}</td>
              </tr>`,
          )}
        </tbody>
      </table>
    `;
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-held-out": EcHeldOut;
  }
}
