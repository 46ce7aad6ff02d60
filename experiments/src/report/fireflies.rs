//! The largest contributions, which are what makes a variance large: one for each method and order, with the command that traces
//! it again.

use super::numbers::{percent, short};
use super::tables::{head, number_cell, scrolling};
use crate::export::markup::Markup;
use crate::fireflies::FireflyRecord;

/// A row for each method and order: its largest contribution.
pub fn table(m: &mut Markup, records: &[&FireflyRecord]) {
    let caption = "The largest contribution to each order, what part of all the order's light it is, its path (the kind of lobe \
                   that has most of each scattering), and the command that traces it again";
    scrolling(m, "Largest contributions", |m| {
        m.line("caption", &[], caption);
        head(m, "method", "", ["order", "size", "part", "path", "command"].iter());
        m.element("tbody", &[], |m| {
            for record in records.iter().filter(|record| record.rank == 0) {
                m.element("tr", &[], |m| {
                    m.element("th", &[("scope", &"row")], |m| m.line("bdi", &[], &record.method));
                    m.line("td", &[], &record.layer);
                    number_cell(m, f64::from(record.size), short(f64::from(record.size)));
                    number_cell(m, record.share, percent(record.share));
                    m.line("td", &[], record.path.as_ref().map_or("—", |shown| &shown.path));
                    m.element("td", &[], |m| m.line("code", &[], &record.replay));
                });
            }
        });
    });
}
