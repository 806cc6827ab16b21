// What the theme leaves open for readers who use a keyboard or a screen reader.
addEventListener("DOMContentLoaded", () => {
  for (const caption of document.querySelectorAll("p.caption[role=heading]"))
    caption.setAttribute("aria-level", "2");
  const body = document.querySelector("article");
  if (body && !document.querySelector("h1")) {
    const heading = document.createElement("h1");
    heading.textContent = document.title.split(" - ")[0];
    body.prepend(heading);
    if (location.pathname.endsWith("search.html") && !location.search) {
      const told = document.createElement("p");
      told.textContent = "Write what you look for into the field at the top of the list of pages.";
      heading.after(told);
    }
  }
  // An option is not broken after its hyphens, but a long path may be.
  for (const word of document.querySelectorAll("code > .pre"))
    if (word.textContent.length < 30) word.classList.add("whole");
  for (const word of document.querySelectorAll("td code > .pre"))
    word.innerHTML = word.innerHTML.replace(/(?<=\w\w)[._](?=\w{4})|\/(?=\w)/g, "$&<wbr>").replace(/--[\w-]+/g, '<span class="option">$&</span>');
  for (const one of document.querySelectorAll("dt.sig"))
    one.querySelector(".sig-paren")?.after(document.createElement("wbr"));
  // Nor is the name of a mode in a table, such as NC-FD.
  for (const cell of document.querySelectorAll("td > p, td"))
    for (const text of cell.childNodes)
      if (text.nodeType === Node.TEXT_NODE)
        text.data = text.data.replace(/\b(N?C|FD|BD|S)-(?=(FD|BD|S|H|L)\b)/g, "$1\u2011");
  // A drawing that is small on a phone opens by itself, to be enlarged.
  for (const image of document.querySelectorAll("article img")) {
    if (image.closest("a") || !image.offsetParent) continue; // of two forms of a picture one is shown
    const link = document.createElement("a");
    link.href = image.src;
    image.replaceWith(link);
    link.append(image);
  }
  document.querySelector("aside.sidebar-drawer")?.setAttribute("aria-label", "All pages");
  // Other versions, where a web server has them beside this one.
  const here = new URL(document.documentElement.dataset.content_root ?? ".", location.href);
  if (location.protocol.startsWith("http"))
    fetch(new URL("../versions.json", here))
      .then((answer) => (answer.ok ? answer.json() : []))
      .then((versions) => {
        const version = here.pathname.split("/").at(-2);
        if (!versions.includes(version)) return;
        const choice = document.createElement("select");
        choice.setAttribute("aria-label", "Version of these pages");
        choice.append(...versions.map((one) => new Option(one, one, one === version, one === version)));
        choice.addEventListener("change", () => {
          location.href = new URL(`../${choice.value}/index.html`, here);
        });
        document.querySelector(".sidebar-brand")?.after(choice);
      })
      .catch(() => {});
  document.querySelector("aside.toc-drawer")?.setAttribute("aria-label", "On this page");
  // The corner of a notebook's table heads nothing.
  for (const corner of document.querySelectorAll("th:empty"))
    corner.replaceWith(document.createElement("td"));
  for (const box of document.querySelectorAll("pre, .table-wrapper, .cell_output .output"))
    if (box.scrollWidth > box.clientWidth || innerWidth < 700) box.tabIndex = 0;
  // The explorer takes the place of its picture once the page is there, where it has room.
  const place = document.querySelector(".explorer");
  if (place && innerWidth >= 1000)
    addEventListener("load", () => {
      const frame = document.createElement("iframe");
      frame.src = "_static/page.html";
      frame.title = "The explorer";
      frame.onload = () => place.firstElementChild.remove();
      place.append(frame);
    });
});
