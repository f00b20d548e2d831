//! Constants of skin and electrodes from recordings of fingers pressed on a flat plate.
//!
//! What a session shows is its sensor's and its contact's: all electrodes read more than in the
//! session without contact, by one factor of conductivity (an untouched sensor shows that alone:
//! 1.08 and 1.2 in MiaoLi/syntouchcontact's recordings), the sensor answers stronger or weaker
//! than another, and a hand held the finger at an attitude that nobody wrote down. `session` has
//! these apart from the `constants`, which all sensors share; `fit` fits both to every load there
//! is and says how sure it is, and `score` tries constants on a sensor that they were not
//! fitted to, beside what knows nothing of force. `shear` holds the model against how electrodes
//! answer tangential force.

pub mod constants;
pub mod fit;
pub mod score;
pub mod session;
pub mod shear;
