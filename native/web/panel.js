// SPDX-License-Identifier: MIT
// Sliders by region, and a search field.

const other = (name) => {
  if (/L$/.test(name)) return name.replace(/L$/, "R");
  return /R$/.test(name) ? name.replace(/R$/, "L") : null;
};
/** Display name of `mouthCornerPullL`: Mouth Corner Pull L. */
const spoken = (name) => {
  const last = name.split(/[.:|]/).pop() || name;
  const words = last.replace(/([a-z0-9])([A-Z])/g, "$1 $2").replace(/_/g, " ");
  return words.charAt(0).toUpperCase() + words.slice(1);
};

export class Panel {
  /** In: regions [{title, controls: [index]}]; names of the raw controls; changed(index, value). */
  constructor(root, regions, names, changed) {
    this.changed = changed;
    this.rows = new Map();
    this.indices = new Map(names.map((name, i) => [name, i]));
    this.names = names;
    this.mirror = root.querySelector("#mirror");
    this.list = root.querySelector("#regions");
    this.empty = root.querySelector("#nothing");
    this.list.append(...regions.map((region, at) => this.section(region, at)));
    const search = root.querySelector("#search");
    search.addEventListener("input", () => this.search(search.value));
  }

  section({ title, controls }, at) {
    const details = document.createElement("details");
    details.open = matchMedia("(min-width: 900px)").matches || at === 0;
    const summary = document.createElement("summary");
    const count = Object.assign(document.createElement("span"), { textContent: controls.length });
    summary.append(title, count);
    details.append(summary, ...controls.map((index) => this.row(index)));
    return details;
  }

  row(index) {
    const name = this.names[index];
    const row = Object.assign(document.createElement("label"), { className: "row", title: name });
    const text = Object.assign(document.createElement("span"), { textContent: spoken(name) });
    const slider = Object.assign(document.createElement("input"), {
      type: "range", min: 0, max: 1, step: 0.001, value: 0,
    });
    slider.setAttribute("aria-label", spoken(name));
    const number = document.createElement("output");
    number.textContent = "0.00";
    slider.addEventListener("input", () => this.slide(index, slider.valueAsNumber));
    row.addEventListener("dblclick", (event) => {
      event.preventDefault();
      this.slide(index, 0);
    });
    row.append(text, slider, number);
    this.rows.set(index, { row, slider, number, words: `${name} ${spoken(name)}`.toLowerCase() });
    return row;
  }

  slide(index, value) {
    const both = [index];
    const twin = this.indices.get(other(this.names[index]) ?? "");
    if (this.mirror.checked && twin !== undefined) both.push(twin);
    for (const i of both) {
      this.show(i, value);
      this.changed(i, value);
    }
  }

  show(index, value) {
    const row = this.rows.get(index);
    if (!row) return;
    const text = value.toFixed(2);
    if (row.number.textContent === text && row.slider.valueAsNumber === value) return;
    row.slider.value = value;
    row.slider.style.setProperty("--part", `${100 * Math.min(Math.max(value, 0), 1)}%`);
    row.number.textContent = text;
    row.row.classList.toggle("moved", value !== 0);
  }

  search(text) {
    const words = text.toLowerCase().split(/\s+/).filter(Boolean);
    let any = false;
    for (const details of this.list.children) {
      let shown = 0;
      for (const row of details.querySelectorAll(".row")) row.hidden = true;
      for (const { row, words: own } of this.rows.values()) {
        if (row.parentElement !== details || !words.every((word) => own.includes(word))) continue;
        row.hidden = false;
        shown += 1;
      }
      details.hidden = shown === 0;
      if (words.length > 0 && shown > 0) details.open = true;
      any ||= shown > 0;
    }
    this.empty.hidden = any;
  }
}
