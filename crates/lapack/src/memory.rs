//! The only module that touches the caller's memory: scalars by pointer, and rectangular or triangular regions of a
//! column-major array, copied in and out whole.
//!
//! | symbol | code   | meaning                                              |
//! |--------|--------|------------------------------------------------------|
//! | m, n   | `rows`, `cols` | size of the region                           |
//! | ld     | `ld`   | distance in elements from one column to the next     |
//!
//! No reference to the caller's arrays is ever formed, so they may be uninitialised where BLAS says that they are not
//! read.
#![expect(unsafe_code, reason = "the arguments are raw pointers: this module is where they are dereferenced")]

use core::ffi::{c_char, c_int};

use faer::{Mat, MatRef};

use crate::scalar::Scalar;

/// Which entries of a square region count; the others are neither read nor written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    All,
    Lower,
    Upper,
}

impl Part {
    fn rows_of_column(self, j: usize, rows: usize) -> core::ops::Range<usize> {
        match self {
            Part::All => 0..rows,
            Part::Lower => j..rows,
            Part::Upper => 0..rows.min(j + 1),
        }
    }
}

/// The shape of a matrix in the caller's memory; `ld >= rows`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Region {
    pub(crate) rows: usize,
    pub(crate) cols: usize,
    pub(crate) ld: usize,
    pub(crate) part: Part,
}

impl Region {
    pub(crate) fn is_empty(self) -> bool {
        self.rows == 0 || self.cols == 0
    }
}

/// A strided vector in the caller's memory; `inc != 0`. With a negative increment the first element is the last in
/// memory, as in BLAS.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strided {
    pub(crate) len: usize,
    pub(crate) inc: isize,
}

impl Strided {
    fn offset(self, i: usize) -> isize {
        let i = i as isize;
        if self.inc > 0 { i * self.inc } else { (i + 1 - self.len as isize) * self.inc }
    }
}

/// The integer at `at`; `i32::MIN` for a null pointer, which every check of a size refuses.
///
/// # Safety
/// `at` is null or points to an integer.
pub(crate) unsafe fn integer(at: *const c_int) -> c_int {
    // SAFETY: not null, hence valid by the caller's promise.
    if at.is_null() { c_int::MIN } else { unsafe { *at } }
}

/// The upper-case letter at `at`; zero for a null pointer, which no option matches.
///
/// # Safety
/// `at` is null or points to a character.
pub(crate) unsafe fn letter(at: *const c_char) -> u8 {
    if at.is_null() {
        return 0;
    }
    // SAFETY: not null, hence valid by the caller's promise. The bytes are the same whatever the sign of `c_char`.
    let [byte] = unsafe { *at }.to_ne_bytes();
    byte.to_ascii_uppercase()
}

/// The number at `at`; NaN for a null pointer.
///
/// # Safety
/// `at` is null or points to a number.
pub(crate) unsafe fn number<T: Scalar>(at: *const T) -> T {
    // SAFETY: not null, hence valid by the caller's promise.
    if at.is_null() { T::NAN } else { unsafe { *at } }
}

/// Writes `value` unless `at` is null.
///
/// # Safety
/// `at` is null or may be written.
pub(crate) unsafe fn put<V>(at: *mut V, value: V) {
    if !at.is_null() {
        // SAFETY: not null, hence valid by the caller's promise.
        unsafe { at.write(value) }
    }
}

/// Copies a region in; entries outside its part become zero.
///
/// # Safety
/// Unless the region is empty, `from` holds `ld * (cols - 1) + rows` elements, initialised in the region's part.
pub(crate) unsafe fn load<T: Scalar>(from: *const T, region: Region) -> Mat<T> {
    let mut values = Mat::zeros(region.rows, region.cols);
    if !region.is_empty() {
        for j in 0..region.cols {
            let rows = region.part.rows_of_column(j, region.rows);
            for (i, value) in rows.clone().zip(&mut values.col_as_slice_mut(j)[rows]) {
                // SAFETY: i < rows and j < cols, so the offset is inside the array.
                *value = unsafe { *from.add(i + j * region.ld) };
            }
        }
    }
    values
}

/// Copies a region out; entries outside its part are left alone.
///
/// # Safety
/// Unless the region is empty, `to` has room for `ld * (cols - 1) + rows` elements. `values` has the region's shape.
pub(crate) unsafe fn store<T: Scalar>(to: *mut T, region: Region, values: MatRef<'_, T>) {
    // SAFETY: the same promise.
    unsafe { store_with(to, region, |i, j| values[(i, j)]) }
}

/// As [`store`], with NaN everywhere.
///
/// # Safety
/// As [`store`].
pub(crate) unsafe fn poison<T: Scalar>(to: *mut T, region: Region) {
    // SAFETY: the same promise.
    unsafe { store_with(to, region, |_, _| T::NAN) }
}

/// # Safety
/// As [`store`].
unsafe fn store_with<T: Scalar>(to: *mut T, region: Region, value: impl Fn(usize, usize) -> T) {
    if !region.is_empty() {
        for j in 0..region.cols {
            for i in region.part.rows_of_column(j, region.rows) {
                // SAFETY: i < rows and j < cols, so the offset is inside the array.
                unsafe { to.add(i + j * region.ld).write(value(i, j)) }
            }
        }
    }
}

/// Copies a strided vector in, as one column.
///
/// # Safety
/// Unless the vector is empty, `from` holds `(len - 1) * |inc| + 1` elements.
pub(crate) unsafe fn load_strided<T: Scalar>(from: *const T, vector: Strided) -> Mat<T> {
    // SAFETY: the offset of each i < len is inside the array.
    Mat::from_fn(vector.len, 1, |i, _| unsafe { *from.offset(vector.offset(i)) })
}

/// Copies one column out to a strided vector; `None` writes NaN.
///
/// # Safety
/// Unless the vector is empty, `to` has room for `(len - 1) * |inc| + 1` elements.
pub(crate) unsafe fn store_strided<T: Scalar>(to: *mut T, vector: Strided, values: Option<MatRef<'_, T>>) {
    for i in 0..vector.len {
        let value = values.map_or(T::NAN, |values| values[(i, 0)]);
        // SAFETY: the offset of each i < len is inside the array.
        unsafe { to.offset(vector.offset(i)).write(value) }
    }
}

/// Copies a slice out.
///
/// # Safety
/// Unless `values` is empty, `to` has room for as many elements.
pub(crate) unsafe fn store_slice<V: Copy>(to: *mut V, values: &[V]) {
    for (i, &value) in values.iter().enumerate() {
        // SAFETY: i < values.len().
        unsafe { to.add(i).write(value) }
    }
}
