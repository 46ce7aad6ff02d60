//! Figures for papers: [`mod@file`] says what a figure's file may hold, [`crops`] sets images side by side with enlarged parts, [`numbers`]
//! has the errors that stand below them, [`plots`] draws what records tell.

pub mod crops;
pub mod file;
pub mod images;
pub mod numbers;
pub mod plots;
pub mod records;

/// Points to a millimetre; figures are drawn in points, of which an inch has 72.
pub const POINTS: f64 = 72.0 / 25.4;
