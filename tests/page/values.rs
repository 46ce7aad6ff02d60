//! What the page says in numbers, against the image files and the records.

use super::*;
use neumann::export::exr::{LayeredImage, read_layers};

/// Half of the last digit of a half float, relative to the value.
const HALF: f64 = 1.0 / 2048.0;
/// By what factor an embedded standard error may be off: a sixteenth of an octave.
const ERROR: f64 = 1.045;

/// A layer's name in image files, by what the viewer calls it.
fn layer(image: &LayeredImage, name: &str, pixel: usize) -> [f64; 3] {
    let found = image.layers.iter().find(|layer| layer.name == name).unwrap_or_else(|| panic!("no layer {name}"));
    found.pixels[pixel].map(f64::from)
}

#[test]
fn values_under_the_cursor_are_those_of_the_image_files() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = small();
    browser.open(&folder.path().join("out/report.html"));
    browser.value("document.querySelector('.stage').focus()");
    // Of eight replicates.
    let quantile = 2.364_624;
    for step in ["w", "d", "W", "s", "s", "a"] {
        browser.press(step);
        for (key, name) in [("0", "order00"), ("1", "order01"), ("2", "order02"), ("End", "")] {
            press(&mut browser, key);
            let read = browser.value(
                "({ place: document.querySelector('.readout caption').textContent.match(/\\d+/g).slice(0, 2).map(Number),
                    rows: ['A', 'B'].map((row) => ({
                      method: document.querySelector(`.readout [data-row=${row}] bdi`).textContent.split(' · ')[0],
                      values: [...document.querySelectorAll(`.readout [data-row=${row}] data`)].map((d) => Number(d.value)),
                      shown: [...document.querySelectorAll(`.readout [data-row=${row}] data`)].map((d) => d.textContent),
                      ends: [...document.querySelectorAll(`.readout [data-row=${row}] td small`)].map((s) => s.textContent),
                    })) })",
            );
            let pixel = (read["place"][1].as_u64().unwrap() * 24 + read["place"][0].as_u64().unwrap()) as usize;
            for row in read["rows"].as_array().unwrap() {
                let method = row["method"].as_str().unwrap();
                let file = match method {
                    "reference" => "cornell_box_reference.exr".to_owned(),
                    _ => format!("cornell_box/{method}.exr"),
                };
                let image = read_layers(&folder.path().join("out").join(file)).unwrap();
                let expected = layer(&image, name, pixel);
                for c in 0..3 {
                    let value = row["values"][c].as_f64().unwrap();
                    let (within, at) = (expected[c].abs() * HALF + 1e-7, format!("{method} {name} {pixel} {c}"));
                    assert!((value - expected[c]).abs() <= within, "{at}: {value} for {}", expected[c]);
                    assert_eq!(row["shown"][c], neumann::report::numbers::short(value), "{at}");
                    if method != "reference" && !name.is_empty() {
                        let error = layer(&image, &format!("{name}_var"), pixel)[c].sqrt();
                        let half = half_width(row["ends"][c].as_str().unwrap());
                        // Ends are written to three digits.
                        let rounding = 0.01 * (value.abs() + half);
                        assert!(
                            half <= error * quantile * ERROR + rounding && half >= error * quantile / ERROR - rounding,
                            "{at}: ±{half} for {error}"
                        );
                    }
                }
            }
        }
    }
    assert_eq!(browser.complaints(), [""; 0]);
}

/// Half the width of `[0.123, 1.5·10⁻⁴]`.
fn half_width(interval: &str) -> f64 {
    let ends: Vec<f64> = interval.trim_matches(['[', ']']).split(", ").map(number).collect();
    (ends[1] - ends[0]) / 2.0
}

/// A number as the page writes it.
fn number(text: &str) -> f64 {
    const EXPONENTS: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹";
    let text = text.replace('−', "-");
    let Some((mantissa, exponent)) = text.split_once("·10") else { return text.parse().unwrap() };
    let digit = |c| EXPONENTS.chars().position(|e| e == c).map_or('-', |d| char::from(b'0' + d as u8));
    format!("{mantissa}e{}", exponent.chars().map(digit).collect::<String>()).parse().unwrap()
}

#[test]
fn numbers_on_the_page_are_those_of_the_records() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = small();
    browser.open(&folder.path().join("out/report.html"));
    let tables = browser.value(
        "[...document.querySelectorAll('table')].filter((t) => t.caption && /^(Image mean|Variance of one|Efficiency)/.test(t.caption.textContent)).map((t) => ({
           caption: t.caption.textContent, heads: [...t.tHead.rows[0].cells].map((c) => c.textContent),
           rows: [...t.tBodies[0].rows].map((r) => [...r.cells].map((c) => c.querySelector('data')?.value ?? c.textContent)) }))",
    );
    let records = std::fs::read_to_string(folder.path().join("out/records.csv")).unwrap();
    let records: Vec<Vec<&str>> = records.lines().map(|line| line.split(',').collect()).collect();
    let mut compared = 0;
    for table in tables.as_array().unwrap() {
        let quantity = match table["caption"].as_str().unwrap() {
            caption if caption.starts_with("Image mean") => "mean",
            caption if caption.starts_with("Variance") => "variance",
            _ => "efficiency",
        };
        for row in table["rows"].as_array().unwrap() {
            let order = match row[0].as_str().unwrap() {
                "E" => "0",
                "TE" => "1",
                "T²E" => "2",
                _ => "total",
            };
            for (column, cell) in row.as_array().unwrap().iter().enumerate().skip(1) {
                let Ok(shown) = cell.as_str().unwrap().parse::<f64>() else { continue };
                let method = table["heads"][column].as_str().unwrap();
                let matches = |r: &&Vec<&str>| r[2] == method && r[5] == order && r[9] == quantity;
                let found: Vec<_> = records.iter().filter(matches).collect();
                // Means are recorded channel by channel.
                let channels: &[&str] = if quantity == "mean" { &["r", "g", "b"] } else { &["all"] };
                let mine = found.iter().filter(|r| channels.contains(&r[10]));
                let values: Vec<f64> = mine.map(|r| r[11].parse().unwrap()).collect();
                assert_eq!(values.len(), channels.len(), "{quantity} of {method} at {order}");
                let recorded = values.iter().sum::<f64>() / values.len() as f64;
                assert!(
                    (shown / recorded - 1.0).abs() < 1e-12,
                    "{quantity} of {method} at {order}: {shown} for {recorded}"
                );
                compared += 1;
            }
        }
    }
    // Three quantities of three methods in four columns, but for what is black or has no variance.
    assert!((24..=36).contains(&compared), "{compared}");
}
