#![allow(missing_docs)]
#[path = "../../tests"]
mod laws {
    pub mod support;
    pub mod pilot;
    pub mod false_alarms;
    pub mod agreement;
}
use laws::support;
