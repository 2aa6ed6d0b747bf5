//! A serial arm from a URDF file.
//!
//! What is read, and how a tree becomes a chain:
//!
//! - The chain runs from the root link to the *tip*: the link named, or the last moving link when the robot does not branch. A robot whose moving joints
//!   branch needs a name; the error lists the candidates.
//! - A fixed joint welds its links. A joint that mimics another one, or whose name contains `finger` or `gripper`, is locked at zero
//!   and welds as well. With a tip named, every joint off the path to it is locked at zero in the same way.
//! - Welded bodies are merged into the moving link that carries them; those that hang on the root do not move and are dropped unread.
//! - Joints on the path must be revolute or continuous. One about another axis than z gets its frame re-oriented; the joint angle stays the
//!   same, the last link's frame turns with it.
//! - `continuous` has an infinite range. An effort or velocity limit of 0, which is also what the parser gives for a missing one, means
//!   that nothing is stated: infinite.
//! - `<dynamics damping, friction>` become viscous and Coulomb friction. Rotor inertia is not in the format: 0.
//! - The flange is the tip; without a tip it is reached from the last moving link along fixed joints while exactly one hangs on each link.
//!
//! Every body with mass is checked under its own name before it is merged: an inertia that no body can have is refused, not repaired. Source of the
//! format: <http://wiki.ros.org/urdf/XML>. Limits: xacro has to be expanded before; `<safety_controller>` and `<calibration>` are ignored.

use std::collections::HashMap;
use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use urdf_rs::{Joint, JointType};

use crate::dispatch::MOST_JOINTS;
use crate::error::RobotError;
use crate::robot::{Frame, GRAVITY_M_PER_S2, Inertia, JointLimits, Link, Robot};

impl Robot {
    /// The arm in a URDF file; `tip` names its last link, needed only when the robot branches. Gravity is 9.81 m/s^2 along -z of the root.
    ///
    /// # Errors
    /// [`RobotError`] names the file, link or joint that is at fault, with its numbers.
    pub fn from_urdf_file(path: &Path, tip: Option<&str>) -> Result<Self, RobotError> {
        let xml = std::fs::read_to_string(path).map_err(|source| RobotError::Read { path: path.into(), source })?;
        Self::from_urdf_str(&xml, tip)
    }

    /// The arm in the text of a URDF file.
    ///
    /// # Errors
    /// As [`Robot::from_urdf_file`].
    pub fn from_urdf_str(xml: &str, tip: Option<&str>) -> Result<Self, RobotError> {
        let description = urdf_rs::read_from_string(xml).map_err(|source| RobotError::Parse { source })?;
        let tree = Tree::new(&description)?;
        tree.chain_to(tip)?.into_robot(&description.name)
    }
}

/// The links as a rooted tree, by index.
struct Tree<'a> {
    description: &'a urdf_rs::Robot,
    root: usize,
    /// Joint that carries each link.
    carrier: Vec<Option<usize>>,
    /// Joints on each link, in file order.
    hanging: Vec<Vec<usize>>,
    /// Child link of each joint.
    child: Vec<usize>,
    /// Parent link of each joint.
    parent: Vec<usize>,
}

fn is_locked(joint: &Joint) -> bool {
    let name = joint.name.to_lowercase();
    joint.joint_type == JointType::Fixed || joint.mimic.is_some() || name.contains("finger") || name.contains("gripper")
}

fn frame_of(pose: &urdf_rs::Pose) -> Frame {
    Frame::from_rpy(pose.xyz.0, pose.rpy.0)
}

impl<'a> Tree<'a> {
    fn new(description: &'a urdf_rs::Robot) -> Result<Self, RobotError> {
        let mut index = HashMap::new();
        for (i, link) in description.links.iter().enumerate() {
            if index.insert(link.name.as_str(), i).is_some() {
                return Err(RobotError::Duplicate { element: "link", name: link.name.clone() });
            }
        }
        let count = description.links.len();
        let (mut carrier, mut hanging) = (vec![None; count], vec![Vec::new(); count]);
        let (mut child, mut parent) = (Vec::new(), Vec::new());
        let mut names = HashMap::new();
        for (j, joint) in description.joints.iter().enumerate() {
            if names.insert(joint.name.as_str(), j).is_some() {
                return Err(RobotError::Duplicate { element: "joint", name: joint.name.clone() });
            }
            let find = |link: &String| {
                index
                    .get(link.as_str())
                    .copied()
                    .ok_or_else(|| RobotError::UnknownLink { joint: joint.name.clone(), link: link.clone() })
            };
            let (from, to) = (find(&joint.parent.link)?, find(&joint.child.link)?);
            if carrier[to].replace(j).is_some() {
                return Err(RobotError::TwoParents { link: joint.child.link.clone() });
            }
            hanging[from].push(j);
            parent.push(from);
            child.push(to);
        }
        let roots: Vec<usize> = (0..count).filter(|&i| carrier[i].is_none()).collect();
        let [root] = roots[..] else {
            let roots = roots.iter().map(|&i| description.links[i].name.clone()).collect();
            return Err(RobotError::Roots { roots });
        };
        let tree = Self { description, root, carrier, hanging, child, parent };
        let reached = tree.below(root);
        if let Some(lost) = (0..count).find(|i| !reached.contains(i)) {
            return Err(RobotError::Loop { link: tree.link_name(lost).into() });
        }
        Ok(tree)
    }

    fn link_name(&self, link: usize) -> &str {
        &self.description.links[link].name
    }

    /// A link and all that hangs on it.
    fn below(&self, link: usize) -> Vec<usize> {
        let mut found = vec![link];
        let mut next = 0;
        while next < found.len() {
            found.extend(self.hanging[found[next]].iter().map(|&j| self.child[j]));
            next += 1;
        }
        found
    }

    /// Joints from the root to a link.
    fn path_to(&self, link: usize) -> Vec<usize> {
        let mut path = Vec::new();
        let mut at = link;
        while let Some(joint) = self.carrier[at] {
            path.push(joint);
            at = self.parent[joint];
        }
        path.reverse();
        path
    }

    fn moves(&self, joint: usize) -> bool {
        !is_locked(&self.description.joints[joint])
    }

    /// Chooses the arm's joints and the link that is its flange.
    fn chain_to(&self, tip: Option<&str>) -> Result<Chain<'_>, RobotError> {
        let links = &self.description.links;
        if let Some(tip) = tip {
            let Some(end) = links.iter().position(|link| link.name == tip) else {
                let leaves = (0..links.len()).filter(|&i| self.hanging[i].is_empty());
                let candidates = leaves.map(|i| self.link_name(i).into()).collect();
                return Err(RobotError::UnknownTip { tip: tip.into(), candidates });
            };
            let moving: Vec<usize> = self.path_to(end).into_iter().filter(|&j| self.moves(j)).collect();
            if moving.is_empty() {
                return Err(RobotError::RigidTip { root: self.link_name(self.root).into(), tip: tip.into() });
            }
            return Ok(Chain { tree: self, moving, end });
        }
        let last_moving: Vec<usize> = (0..self.child.len())
            .filter(|&j| self.moves(j))
            .filter(|&j| {
                let below = self.below(self.child[j]);
                !below.iter().any(|&link| self.hanging[link].iter().any(|&k| self.moves(k)))
            })
            .collect();
        let [last] = last_moving[..] else {
            if last_moving.is_empty() {
                return Err(RobotError::NoJoint);
            }
            let candidates = last_moving.iter().map(|&j| self.link_name(self.child[j]).into()).collect();
            return Err(RobotError::Branches { candidates });
        };
        let mut end = self.child[last];
        let moving = self.path_to(end).into_iter().filter(|&j| self.moves(j)).collect();
        while let [only] = self.hanging[end][..] {
            if self.description.joints[only].joint_type != JointType::Fixed {
                break;
            }
            end = self.child[only];
        }
        Ok(Chain { tree: self, moving, end })
    }
}

/// The arm's joints, base to tip, and the link that is its flange.
struct Chain<'a> {
    tree: &'a Tree<'a>,
    moving: Vec<usize>,
    end: usize,
}

/// A rotation that takes +z to `axis`, exact for axes along x, y and z.
fn rotation_from_z(axis: &Vector3<f64>) -> Matrix3<f64> {
    if axis.z < 0.0 {
        // Half a turn about x first, then from +z to the opposite axis.
        return rotation_from_z(&-axis) * Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0);
    }
    let (x, y, z) = (axis.x, axis.y, axis.z);
    let k = (1.0 + z).recip();
    Matrix3::new(1.0 - x * x * k, -x * y * k, x, -x * y * k, 1.0 - y * y * k, y, -x, -y, z)
}

fn axis_frame(joint: &Joint) -> Result<Frame, RobotError> {
    let axis = Vector3::from(joint.axis.xyz.0);
    let length = axis.norm();
    if !(length > 0.0 && length.is_finite()) {
        return Err(RobotError::Axis { joint: joint.name.clone(), axis: joint.axis.xyz.0 });
    }
    Ok(Frame::from_parts(Vector3::zeros(), rotation_from_z(&(axis / length))))
}

fn inverse_rotation(frame: &Frame) -> Frame {
    Frame::from_parts(Vector3::zeros(), frame.rotation_matrix().transpose())
}

fn limits_of(joint: &Joint) -> Result<JointLimits, RobotError> {
    let stated = |limit: f64| if limit.abs() <= 0.0 { f64::INFINITY } else { limit };
    let (speed_rad_per_s, torque_n_m) = (stated(joint.limit.velocity), stated(joint.limit.effort));
    let kind = match joint.joint_type {
        JointType::Revolute => {
            let (lower_rad, upper_rad) = (joint.limit.lower, joint.limit.upper);
            return Ok(JointLimits { lower_rad, upper_rad, speed_rad_per_s, torque_n_m });
        }
        JointType::Continuous => return Ok(JointLimits { speed_rad_per_s, torque_n_m, ..JointLimits::NONE }),
        JointType::Prismatic => "prismatic",
        JointType::Fixed => "fixed",
        JointType::Floating => "floating",
        JointType::Planar => "planar",
        JointType::Spherical => "spherical",
    };
    Err(RobotError::JointKind { joint: joint.name.clone(), kind })
}

/// The body of a URDF link in the link's frame; nothing when it has no mass.
fn body_of(link: &urdf_rs::Link) -> Result<Option<Inertia>, RobotError> {
    let inertial = &link.inertial;
    let urdf_rs::Inertia { ixx, ixy, ixz, iyy, iyz, izz } = inertial.inertia;
    let entries = [ixx, iyy, izz, ixy, ixz, iyz];
    if inertial.mass.value.abs() <= 0.0 {
        let entry_kg_m2 = entries.iter().fold(0.0_f64, |most, x| if x.abs() <= most { most } else { x.abs() });
        return if entry_kg_m2.abs() <= 0.0 {
            Ok(None)
        } else {
            Err(RobotError::InertiaWithoutMass { link: link.name.clone(), entry_kg_m2 })
        };
    }
    let own = Inertia { mass_kg: inertial.mass.value, com_m: [0.0; 3], about_com_kg_m2: entries };
    own.check_physical(&link.name)?;
    let frame = frame_of(&inertial.origin);
    if let Some(&value) = frame.xyz_m.iter().chain(frame.rotation.iter().flatten()).find(|x| !x.is_finite()) {
        return Err(RobotError::FrameNotFinite { link: link.name.clone(), value });
    }
    Ok(Some(own.in_parent(&frame)))
}

impl Chain<'_> {
    fn into_robot(self, name: &str) -> Result<Robot, RobotError> {
        let description = self.tree.description;
        if self.moving.len() > MOST_JOINTS {
            return Err(RobotError::TooManyJoints { robot: name.into(), joints: self.moving.len(), most: MOST_JOINTS });
        }
        let mut links: Vec<Link> = Vec::new();
        let mut flange = Frame::IDENTITY;
        // A link of the file, the arm's link that carries it, and its frame there.
        let mut waiting = vec![(self.tree.root, None, Frame::IDENTITY)];
        while let Some((at, carrier, frame)) = waiting.pop() {
            let source = &description.links[at];
            if let Some(carrier) = carrier {
                let arm_link: &mut Link = &mut links[carrier];
                if let Some(body) = body_of(source)? {
                    arm_link.inertia = arm_link.inertia.merged(&body.in_parent(&frame));
                }
                if at == self.end {
                    flange = frame;
                }
            }
            // The stack returns the last one first: file order is kept, and the path's joint comes when its turn is.
            for &j in self.tree.hanging[at].iter().rev() {
                let joint = &description.joints[j];
                let here = frame.then(&frame_of(&joint.origin));
                if !self.moving.contains(&j) {
                    waiting.push((self.tree.child[j], carrier, here));
                    continue;
                }
                let limits = limits_of(joint)?;
                let turned = axis_frame(joint)?;
                let dynamics = joint.dynamics.clone().unwrap_or_default();
                links.push(Link {
                    name: self.tree.link_name(self.tree.child[j]).into(),
                    joint_name: joint.name.clone(),
                    frame: here.then(&turned),
                    inertia: Inertia::NONE,
                    limits,
                    rotor_inertia_kg_m2: 0.0,
                    viscous_n_m_s_per_rad: dynamics.damping,
                    coulomb_n_m: dynamics.friction,
                });
                waiting.push((self.tree.child[j], Some(links.len() - 1), inverse_rotation(&turned)));
            }
        }
        Robot::new(name, GRAVITY_M_PER_S2, links)?.with_flange(flange)
    }
}
