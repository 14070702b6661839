import { LitElement, css, html, nothing } from "lit";
import { customElement, property } from "lit/decorators.js";

import { figure, percent, unitWords } from "../common/format";
import { words } from "../common/names";
import { sharedStyles } from "../common/shared-styles";
import { tableStyles } from "../common/table-styles";
import type { Candidate } from "../data/types";

/** How the cost of a candidate comes about: each part's value, its weight, and what it adds. */
@customElement("ec-cost")
export class EcCost extends LitElement {
  @property({ attribute: false }) candidate: Candidate | null = null;

  static override styles = [
    sharedStyles,
    tableStyles,
    css`
      tfoot td {
        font-weight: 620;
      }
    `,
  ];

  override render() {
    const cost = this.candidate?.cost;
    if (!cost) return nothing;
    return html`<table class="number">
      <thead>
        <tr>
          <th>Less is better</th>
          <th>Value</th>
          <th>Weight</th>
          <th>Adds</th>
        </tr>
      </thead>
      <tbody>
        ${cost.parts.map((part) => {
          const unit = unitWords(part.unit);
          const space = unit === "" || unit === "°" ? "" : " ";
          return html`<tr>
            <td>${words(part.name)}</td>
            <td>${figure(part.value)}${space}${unit}</td>
            <td>${percent(part.weight)}</td>
            <td>${figure(part.contribution)}</td>
          </tr>`;
        })}
      </tbody>
      <tfoot>
        <tr>
          <td>Cost</td>
          <td></td>
          <td></td>
          <td>${figure(cost.total)}</td>
        </tr>
      </tfoot>
    </table>`;
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-cost": EcCost;
  }
}
