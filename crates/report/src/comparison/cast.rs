//! Which controller has which name and colour.

use serde::Serialize;

use crate::figure::Ink;
use crate::record::{Controller, ControllerInk};

/// The controllers of a page.
#[derive(Clone, Copy)]
pub(super) struct Cast<'a>(pub(super) &'a [Controller]);

/// A controller as the page names it.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Player<'a> {
    /// Short name.
    pub(super) name: &'a str,
    /// Class of its words in the style sheet.
    class: &'static str,
    /// Stroke of its sample in a legend.
    stroke: String,
    #[serde(skip)]
    pub(super) ink: Ink,
}

impl<'a> Cast<'a> {
    /// The controller with that name in the record, which has been checked to exist.
    pub(super) fn player(&self, id: &str) -> Option<Player<'a>> {
        self.0.iter().find(|controller| controller.id == id).map(player)
    }

    /// Those of the given names, each once, in the order of the page.
    pub(super) fn players<'b>(&self, ids: impl Iterator<Item = &'b String> + Clone) -> Vec<Player<'a>> {
        self.0.iter().filter(|controller| ids.clone().any(|id| *id == controller.id)).map(player).collect()
    }
}

pub(super) fn player(controller: &Controller) -> Player<'_> {
    let (ink, class) = match controller.ink {
        ControllerInk::AicPublished => (Ink::AicPublished, "aic-published"),
        ControllerInk::AicTuned => (Ink::AicTuned, "aic-tuned"),
        ControllerInk::AicOther => (Ink::AicOther, "aic-other"),
        ControllerInk::MracCode => (Ink::MracCode, "mrac-code"),
        ControllerInk::MracPaper => (Ink::MracPaper, "mrac-paper"),
        ControllerInk::MracTuned => (Ink::MracTuned, "mrac-tuned"),
        ControllerInk::Baseline => (Ink::Baseline, "baseline"),
    };
    Player { name: &controller.name, class, stroke: ink.sentinel(), ink }
}
