//! One figure: axes, marks, direct labels; drawn to an `<svg>` element.

use plotters::coord::Shift;
use plotters::element::{Circle, PathElement, Polygon, Rectangle, Text};
use plotters::prelude::{Color, DrawingArea, IntoDrawingArea, SVGBackend, ShapeStyle};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, IntoFont, TextStyle};
use serde::Serialize;

use super::Axis;
use super::ink::Ink;
use super::readings::Readings;
use super::thin::{Point, finite_runs};
use crate::error::ReportError;

/// Canvas units a nominal pixel: plotters rounds to whole units.
pub(super) const SCALE: f64 = 4.0;

/// Height of letters, in nominal pixels.
const LETTERS: f64 = 11.5;

/// Room above the plot (title), below it (ticks and caption).
const TOP: f64 = 26.0;
const BOTTOM: f64 = 38.0;

/// Least room for the ticks of the vertical axis.
const LEFT: f64 = 40.0;

/// Least distance of two labels at the right end.
const LABEL_DISTANCE: f64 = 14.0;

/// One figure.
pub(crate) struct Plot {
    /// Stands above the figure and names it for a screen reader.
    pub(crate) title: String,
    /// What a reader sees, for one who does not.
    pub(crate) description: String,
    /// Nominal width and height.
    pub(crate) size: (f64, f64),
    /// Horizontal axis.
    pub(crate) x: Axis,
    /// Vertical axis.
    pub(crate) y: Axis,
    /// Room at the right end for labels of curves.
    pub(crate) right: f64,
    /// What is drawn, in order.
    pub(crate) marks: Vec<Mark>,
}

/// One thing to draw; values outside the axes are put on the frame, NaN is a gap.
pub(crate) enum Mark {
    /// A curve.
    Line { ink: Ink, width: f64, points: Vec<Point> },
    /// The area between two curves: `(x, lower, upper)`.
    Band { ink: Ink, opacity: f64, points: Vec<(f64, f64, f64)> },
    /// Points.
    Dots { ink: Ink, radius: f64, opacity: f64, points: Vec<Point> },
    /// A rectangle between two corners.
    Block { ink: Ink, opacity: f64, from: Point, to: Point },
    /// A horizontal bar of the given height in nominal pixels.
    Bar { ink: Ink, opacity: f64, height: f64, from: Point, to_x: f64 },
    /// A vertical line.
    Vertical { ink: Ink, x: f64 },
    /// A vertical line at each tick.
    Ticks,
    /// A horizontal line.
    Horizontal { ink: Ink, y: f64 },
    /// Words at a point, moved by nominal pixels.
    Label { ink: Ink, text: String, at: Point, shift: (f64, f64), anchor: Anchor },
    /// Words right of the plot, at the height of a curve's end; moved apart when two would touch.
    EndLabel { ink: Ink, text: String, y: f64 },
}

/// Which side of the words the point is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// Where values lie in a drawing: for scripts that read or move it.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Geometry {
    /// Left, right, top and bottom of the axes, in units of the view box.
    frame: [f64; 4],
    /// Range of the horizontal axis.
    x: (f64, f64),
    /// Range of the vertical axis.
    y: (f64, f64),
}

/// The rectangle of the axes, in nominal pixels.
struct Frame {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), Box<dyn std::error::Error + Send + Sync>>;

impl Plot {
    /// The figure as an `<svg>` element that fills the width it is given.
    ///
    /// # Errors
    /// [`ReportError::Draw`] when the drawing library fails.
    pub(crate) fn svg(&self) -> Result<String, ReportError> {
        let mut raw = String::new();
        self.draw(&mut raw).map_err(|source| ReportError::Draw { figure: self.title.clone(), source })?;
        // The library's own opening tag fixes the size in pixels and names a namespace that HTML does not need.
        let body = raw.split_once('>').map_or(raw.as_str(), |(_, body)| body).trim_start();
        let body = body
            .replace(" opacity=\"1\"", "")
            .replace(" font-family=\"sans-serif\"", "")
            .replace(" stroke=\"none\" stroke-width=\"1\"", "")
            .replace(">\n", ">");
        let (width, height) = (units(self.size.0), units(self.size.1));
        let (title, description) = (escaped(&self.title), escaped(&self.description));
        Ok(format!(
            "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{title}\"><title>{title}</title><desc>{description}</desc>{body}"
        ))
    }

    /// [`Plot::svg`], followed by the values that a script reads off it.
    ///
    /// # Errors
    /// As [`Plot::svg`], and [`ReportError::Json`].
    pub(crate) fn svg_with(&self, readings: &Readings) -> Result<String, ReportError> {
        let data = readings.json(self.geometry())?;
        Ok(format!("{}<script type=\"application/json\" class=\"readings\">{data}</script>", self.svg()?))
    }

    /// Where values lie in the drawing.
    pub(crate) fn geometry(&self) -> Geometry {
        let Frame { left, right, top, bottom } = self.frame();
        Geometry {
            frame: [left, right, top, bottom].map(|length| f64::from(units(length))),
            x: self.x.range(),
            y: self.y.range(),
        }
    }

    /// Where a point lies in the drawing, in units of the view box; `None` for a NaN.
    pub(crate) fn place(&self, point: Point) -> Option<(i32, i32)> {
        self.at(&self.frame(), point).map(pixel)
    }

    /// Changes the height so that a unit of both axes has the same length.
    pub(crate) fn true_to_scale(mut self) -> Self {
        let Frame { left, right, .. } = self.frame();
        let ((x0, x1), (y0, y1)) = (self.x.range(), self.y.range());
        self.size.1 = TOP + BOTTOM + (right - left) * (y1 - y0) / (x1 - x0);
        self
    }

    fn draw(&self, buffer: &mut String) -> Drawn {
        let frame = self.frame();
        let size = (units(self.size.0).unsigned_abs(), units(self.size.1).unsigned_abs());
        let area = SVGBackend::with_string(buffer, size).into_drawing_area();
        self.draw_axes(&area, &frame)?;
        for mark in &self.marks {
            self.draw_mark(&area, &frame, mark)?;
        }
        self.draw_end_labels(&area, &frame)?;
        area.present()?;
        Ok(())
    }

    fn frame(&self) -> Frame {
        let widest = self.y.ticks().iter().map(|(_, label)| label.chars().count()).max().unwrap_or(0);
        Frame {
            // At least `LEFT`, so that the axes of neighbours line up.
            left: (widest as f64 * 0.6 * LETTERS + 11.0).max(LEFT),
            right: self.size.0 - self.right.max(10.0),
            top: TOP,
            bottom: self.size.1 - BOTTOM,
        }
    }

    fn at(&self, frame: &Frame, (x, y): Point) -> Option<(f64, f64)> {
        let (x, y) = (self.x.fraction(x)?, self.y.fraction(y)?);
        Some((frame.left + x * (frame.right - frame.left), frame.bottom - y * (frame.bottom - frame.top)))
    }

    fn draw_axes(&self, area: &Area, frame: &Frame) -> Drawn {
        let caption = if self.y.caption.is_empty() { &self.title } else { &self.y.caption };
        write(area, caption, (2.0, 9.0), Ink::Text, Anchor::Start, true)?;
        write(area, &self.x.caption, (frame.right, self.size.1 - 6.0), Ink::Axis, Anchor::End, false)?;
        for (value, label) in self.y.ticks() {
            let Some((_, y)) = self.at(frame, (self.x.range().0, *value)) else { continue };
            line(area, Ink::Grid, 1.0, &[(frame.left, y), (frame.right, y)])?;
            write(area, label, (frame.left - 6.0, y), Ink::Axis, Anchor::End, false)?;
        }
        line(area, Ink::Axis, 1.0, &[(frame.left, frame.bottom), (frame.right, frame.bottom)])?;
        for (value, label) in self.x.ticks() {
            let Some((x, _)) = self.at(frame, (*value, self.y.range().0)) else { continue };
            line(area, Ink::Axis, 1.0, &[(x, frame.bottom), (x, frame.bottom + 4.0)])?;
            write(area, label, (x, frame.bottom + 13.0), Ink::Axis, Anchor::Middle, false)?;
        }
        Ok(())
    }

    fn draw_mark(&self, area: &Area, frame: &Frame, mark: &Mark) -> Drawn {
        let place = |points: &[Point]| points.iter().filter_map(|p| self.at(frame, *p)).collect::<Vec<_>>();
        match mark {
            Mark::Line { ink, width, points } => {
                for run in finite_runs(points) {
                    line(area, *ink, *width, &place(run))?;
                }
            }
            Mark::Band { ink, opacity, points } => {
                let whole = |p: &&(f64, f64, f64)| p.0.is_finite() && p.1.is_finite() && p.2.is_finite();
                let lower = points.iter().filter(whole).map(|(x, lower, _)| (*x, *lower));
                let upper = points.iter().rev().filter(whole).map(|(x, _, upper)| (*x, *upper));
                let outline = place(&lower.chain(upper).collect::<Vec<_>>());
                if outline.len() > 2 {
                    let outline: Vec<_> = outline.into_iter().map(pixel).collect();
                    area.draw(&Polygon::new(outline, ink.color().mix(*opacity)))?;
                }
            }
            Mark::Dots { ink, radius, opacity, points } => {
                for point in place(points) {
                    area.draw(&Circle::new(pixel(point), units(*radius), ink.color().mix(*opacity).filled()))?;
                }
            }
            Mark::Block { ink, opacity, from, to } => {
                if let [from, to] = place(&[*from, *to])[..] {
                    block(area, *ink, *opacity, from, to)?;
                }
            }
            Mark::Bar { ink, opacity, height, from, to_x } => {
                if let [from, to] = place(&[*from, (*to_x, from.1)])[..] {
                    let half = 0.5 * height;
                    block(area, *ink, *opacity, (from.0.min(to.0), from.1 - half), (from.0.max(to.0), from.1 + half))?;
                }
            }
            Mark::Vertical { ink, x } => {
                if let Some((x, _)) = self.at(frame, (*x, self.y.range().0)) {
                    line(area, *ink, 1.2, &[(x, frame.top), (x, frame.bottom)])?;
                }
            }
            Mark::Ticks => {
                for (value, _) in self.x.ticks() {
                    self.draw_mark(area, frame, &Mark::Vertical { ink: Ink::Grid, x: *value })?;
                }
            }
            Mark::Horizontal { ink, y } => {
                if let Some((_, y)) = self.at(frame, (self.x.range().0, *y)) {
                    line(area, *ink, 1.2, &[(frame.left, y), (frame.right, y)])?;
                }
            }
            Mark::Label { ink, text, at, shift, anchor } => {
                if let Some((x, y)) = self.at(frame, *at) {
                    write(area, text, (x + shift.0, y + shift.1), *ink, *anchor, false)?;
                }
            }
            Mark::EndLabel { .. } => {} // Placed together, once all heights are known.
        }
        Ok(())
    }

    fn draw_end_labels(&self, area: &Area, frame: &Frame) -> Drawn {
        let mut labels: Vec<_> = self
            .marks
            .iter()
            .filter_map(|mark| match mark {
                Mark::EndLabel { ink, text, y } => {
                    self.at(frame, (self.x.range().1, *y)).map(|(_, height)| (height, *ink, text))
                }
                _ => None,
            })
            .collect();
        labels.sort_by(|a, b| a.0.total_cmp(&b.0));
        // From the bottom up first, so that a crowd at the floor stays inside the frame.
        let mut floor = frame.bottom + LABEL_DISTANCE;
        for label in labels.iter_mut().rev() {
            label.0 = label.0.min(floor - LABEL_DISTANCE);
            floor = label.0;
        }
        for (height, ink, text) in labels {
            write(area, text, (frame.right + 6.0, height), ink, Anchor::Start, false)?;
        }
        Ok(())
    }
}

fn line(area: &Area, ink: Ink, width: f64, points: &[Point]) -> Drawn {
    let points: Vec<_> = points.iter().copied().map(pixel).collect();
    area.draw(&PathElement::new(points, ShapeStyle::from(ink.color()).stroke_width(units(width).unsigned_abs())))?;
    Ok(())
}

fn block(area: &Area, ink: Ink, opacity: f64, from: Point, to: Point) -> Drawn {
    area.draw(&Rectangle::new([pixel(from), pixel(to)], ink.color().mix(opacity).filled()))?;
    Ok(())
}

fn write(area: &Area, text: &str, at: Point, ink: Ink, anchor: Anchor, strong: bool) -> Drawn {
    if text.is_empty() {
        return Ok(());
    }
    let side = match anchor {
        Anchor::Start => HPos::Left,
        Anchor::Middle => HPos::Center,
        Anchor::End => HPos::Right,
    };
    // The backend divides the size by 1.24 and shifts "centred" text by half an x-height.
    let font = ("sans-serif", SCALE * LETTERS * 1.24).into_font();
    let font = if strong { font.style(FontStyle::Bold) } else { font };
    let color = ink.color();
    let style = TextStyle::from(font).color(&color).pos(Pos::new(side, VPos::Center));
    area.draw(&Text::new(text.to_owned(), pixel(at), style))?;
    Ok(())
}

fn pixel((x, y): Point) -> (i32, i32) {
    (units(x), units(y))
}

fn units(nominal: f64) -> i32 {
    (SCALE * nominal).round() as i32
}

fn escaped(text: &str) -> String {
    text.chars().fold(String::with_capacity(text.len()), |mut escaped, letter| {
        match letter {
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '&' => escaped.push_str("&amp;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            other => escaped.push(other),
        }
        escaped
    })
}
