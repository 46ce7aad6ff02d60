// Plots that can be switched: one figure or all of a group, and in each the series that are asked for.

function figuresOf(group) {
  const figures = [...group.querySelectorAll("figure")];
  const names = new Map();
  for (const series of group.querySelectorAll("[data-series]")) names.set(series.dataset.series, series.dataset.name);
  return { figures, names };
}

// The choice of a figure, and a box for every series.
function switches(group, number) {
  const { figures, names } = figuresOf(group);
  const titles = figures.map((figure) => figure.querySelector("svg text")?.textContent ?? "");
  const one = make("select", { name: `figure-${number}` }, make("option", { value: "" }, "all"));
  titles.forEach((title, i) => one.append(make("option", { value: i }, title)));
  one.addEventListener("change", () => {
    figures.forEach((figure, i) => (figure.hidden = one.value !== "" && Number(one.value) !== i));
    group.classList.toggle("alone", one.value !== "");
  });
  const boxes = [...names].map(([series, name]) => {
    const box = make("input", { type: "checkbox", checked: true, value: series });
    box.addEventListener("change", () => {
      for (const drawn of group.querySelectorAll(`[data-series="${series}"]`)) drawn.style.display = box.checked ? "" : "none";
    });
    return make("label", {}, box, make("bdi", {}, name));
  });
  return make("div", { class: "switches" }, make("label", {}, make("span", {}, "figure"), one), make("fieldset", {}, make("legend", {}, "series"), ...boxes));
}

// Several groups of one section are chosen among by name: those of a convergence, by order and by method.
function tabs(box, number) {
  const groups = [...box.querySelectorAll("[data-group]")];
  const bars = groups.map((group, i) => switches(group, `${number}-${i}`));
  const show = (chosen) => groups.forEach((group, i) => (group.hidden = bars[i].hidden = i !== chosen));
  const choice = make("fieldset", { class: "choice" }, make("legend", {}, "a figure for each"));
  groups.forEach((group, i) => {
    const radio = make("input", { type: "radio", name: `group-${number}`, checked: i === 0 });
    radio.addEventListener("change", () => show(i));
    choice.append(make("label", {}, radio, group.dataset.group));
  });
  box.prepend(...(groups.length > 1 ? [choice] : []), ...bars);
  box.querySelectorAll("details").forEach((details) => details.replaceWith(...details.querySelectorAll("[data-group]")));
  show(0);
}

document.querySelectorAll(".switched").forEach(tabs);
