//! Two fingers, paper, and a browser without scripts.

use super::*;

/// Two fingers on the stage, this part of its width to the left and right of a place in it.
fn fingers(browser: &mut Browser, apart: f64) -> [(f64, f64); 2] {
    let place = browser.value(
        "(() => { const b = document.querySelector('.stage canvas').getBoundingClientRect(); return [b.left, b.top, b.width, b.height] })()",
    );
    let [left, top, width, height] = [0, 1, 2, 3].map(|i| place[i].as_f64().unwrap());
    [-1.0, 1.0].map(|side| (left + width * (0.5 + side * apart / 2.0), top + height * 0.4))
}

#[test]
fn two_fingers_zoom_and_one_moves() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = small();
    browser.resize(390, 800);
    browser.touches();
    browser.open(&folder.path().join("out/report.html"));
    browser.value("document.querySelector('.stage').scrollIntoView({ block: 'center' })");
    let zoom = "Number(document.querySelector('.viewer').dataset.zoom || 1)";
    let shown = |browser: &mut Browser| painted(browser, [0.0, 0.0, 1.0, 1.0]);
    let before = shown(&mut browser);
    let paths: Vec<_> = [0.2, 0.3, 0.4, 0.5, 0.6].map(|apart| fingers(&mut browser, apart)).into();
    browser.touch(&paths);
    // Three times as far apart: three times as large.
    browser.wait(&format!("{zoom} > 1.5"));
    let zoomed = browser.value(zoom).as_f64().unwrap();
    assert!((zoomed / 3.0).ln().abs() < 0.05, "{zoomed}");
    let near = shown(&mut browser);
    assert_ne!(near, before);
    // One finger moves what is seen, and the page stays where it is.
    let scrolled = browser.value("scrollY");
    let one = |x: f64| [fingers(&mut browser, x)[1]];
    let path: Vec<_> = [0.1, 0.2, 0.3, 0.4].map(one).into();
    browser.touch(&path);
    assert_ne!(shown(&mut browser), near, "one finger does not move the image");
    assert_eq!((browser.value(zoom).as_f64(), browser.value("scrollY")), (Some(zoomed), scrolled));
    let away: Vec<_> = [0.6, 0.4, 0.2, 0.1].map(|apart| fingers(&mut browser, apart)).into();
    browser.touch(&away);
    browser.wait(&format!("{zoom} === 1"));
    assert_eq!(browser.complaints(), [""; 0]);
}

/// What of these is seen.
fn seen(browser: &mut Browser, which: &str) -> u64 {
    let count = format!("[...document.querySelectorAll('{which}')].filter((e) => e.getClientRects().length).length");
    browser.value(&count).as_u64().unwrap()
}

#[test]
fn on_paper_there_are_figures_and_tables_and_nothing_to_press() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = small();
    browser.open(&folder.path().join("out/report.html"));
    // What is folded stays so.
    let [pictures, plots] = [".pictures img:not(details *)", "figure svg"].map(|which| seen(&mut browser, which));
    assert!(pictures > 0 && plots > 0 && seen(&mut browser, ".controls select") > 0);
    browser.print();
    // A page of A4 has 794 pixels.
    browser.resize(794, 1123);
    assert_eq!([".controls *", ".help *", ".switches *"].map(|which| seen(&mut browser, which)), [0; 3]);
    let on_paper = [".pictures img:not(details *)", "figure svg"].map(|which| seen(&mut browser, which));
    assert!(on_paper[0] >= pictures && on_paper[1] >= plots, "{on_paper:?} of {pictures} and {plots}");
    let paper = browser.pages();
    assert!(paper.starts_with(b"%PDF-") && paper.len() > 50_000, "{} bytes", paper.len());
    assert_eq!(browser.complaints(), [""; 0]);
}

#[test]
fn without_scripts_there_are_figures_and_tables() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = small();
    let page = folder.path().join("out/report.html");
    browser.open(&page);
    let tables = browser.value("document.querySelectorAll('table:not(.readout *)').length");
    browser.without_scripts(&page);
    assert_eq!(seen(&mut browser, ".viewer"), 0, "a viewer that does nothing");
    // Four layers and sums of three methods; the plots of every order and of every method.
    assert!(seen(&mut browser, ".pictures img") >= 3 * 3 && seen(&mut browser, "figure svg") >= 2 + 4);
    assert_eq!(browser.value("document.querySelectorAll('table').length"), tables);
    assert_eq!(seen(&mut browser, "figure[hidden], .switches"), 0);
    assert!(browser.value("document.querySelector('.summary').innerText.length").as_u64().unwrap() > 40);
    // Pictures are data of the page, and are decoded.
    browser.value("document.querySelector('.pictures').scrollIntoView()");
    browser
        .wait("[...document.querySelectorAll('.pictures img')].slice(0, 3).every((i) => i.complete && i.naturalWidth)");
}
