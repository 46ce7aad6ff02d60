#![allow(missing_docs)]
#[path = "../../tests"]
mod laws {
    pub mod support;
    pub mod pilot;
}
use laws::support;
