import { LitElement, css, html, nothing } from "lit";
import { customElement, property } from "lit/decorators.js";

import { figure } from "../common/format";
import { methodWords } from "../common/names";
import { sharedStyles } from "../common/shared-styles";
import type { Candidate } from "../data/types";
import { baselineRows } from "./baseline-rows";

/** What simpler predictors say of the same candidate, and which one each of them would pick. */
@customElement("ec-baselines")
export class EcBaselines extends LitElement {
  @property({ attribute: false }) candidates: Candidate[] = [];
  @property() selected: string | null = null;
  @property() method = "";

  static override styles = [
    sharedStyles,
    css`
      :host {
        display: block;
      }
      table {
        border-collapse: collapse;
        width: 100%;
      }
      th {
        font-weight: 560;
        font-size: 0.79rem;
        color: var(--ink-soft);
        text-align: right;
      }
      td {
        text-align: right;
      }
      th:first-child,
      td:first-child {
        text-align: left;
      }
      th,
      td {
        padding: 0.32rem 0 0.32rem 0.8rem;
        border-bottom: 1px solid var(--line);
      }
      th:first-child,
      td:first-child {
        padding-left: 0;
      }
      tr:last-child td {
        border-bottom: none;
      }
    `,
  ];

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
