import { LitElement, html, nothing } from "lit";
import { customElement, property } from "lit/decorators.js";

import { figure } from "../common/format";
import { methodWords } from "../common/names";
import { sharedStyles } from "../common/shared-styles";
import { tableStyles } from "../common/table-styles";
import type { Candidate } from "../data/types";
import { baselineRows } from "./baseline-rows";

/** What simpler predictors say of the same candidate, and which one each of them would pick. */
@customElement("ec-baselines")
export class EcBaselines extends LitElement {
  @property({ attribute: false }) candidates: Candidate[] = [];
  @property() selected: string | null = null;
  @property() method = "";

  static override styles = [sharedStyles, tableStyles];

  override render() {
    const rows = baselineRows(this.candidates, this.selected, this.method);
    if (rows.length < 2) return html`<p class="soft">No other method was run.</p>`;
    const ours = rows[0]!.pick;
    return html`<table class="number">
      <thead>
        <tr>
          <th>Method</th>
          <th>Mean RULA</th>
          <th>Cost</th>
          <th>Would take</th>
        </tr>
      </thead>
      <tbody>
        ${rows.map(
          (row) =>
            html`<tr>
              <td>${methodWords(row.method)}</td>
              <td>${row.rula === null ? "–" : row.rula.toFixed(2)}</td>
              <td>${row.cost === null ? "–" : figure(row.cost)}</td>
              <td>
                ${row.pick ?? "–"}
                ${
                  row.pick !== null && row.pick !== ours
                    ? html`<span class="tag warn">differs</span>`
                    : nothing
                }
              </td>
            </tr>`,
        )}
      </tbody>
    </table>`;
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-baselines": EcBaselines;
  }
}
