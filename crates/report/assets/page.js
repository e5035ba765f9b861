// What the page does without a 3D view: printing the operator sheet alone, films of maps with their sliders.
"use strict";
const $ = (id) => document.getElementById(id);
if ($("print-sheet")) $("print-sheet").addEventListener("click", () => {
  document.body.classList.add("sheet-only");
  window.print();
  document.body.classList.remove("sheet-only");
});
// films of one length move together
const films = [...document.querySelectorAll("input.film")];
for (const slider of films) slider.addEventListener("input", () => {
  for (const other of films.filter((f) => f.max === slider.max)) {
    other.value = slider.value;
    const figure = other.closest("figure");
    const shots = figure.querySelectorAll("g.shot");
    shots.forEach((shot, n) => { shot.style.display = n === Number(other.value) ? "" : "none"; });
    figure.querySelector("label.film output").textContent = shots[other.value].dataset.label;
  }
});
