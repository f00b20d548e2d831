//! Domain and network interfaces of ROS 2: from settings, else from the environment of ROS.

use super::settings::{BackendSettings, DOMAIN_MAX};
use std::net::{IpAddr, Ipv4Addr};

/// Where ROS 2 looks for its peers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Network {
    /// Domain of DDS.
    pub domain: u16,
    /// Addresses of the interfaces that are multicast to and announced; `None` for all.
    pub addresses: Option<Vec<IpAddr>>,
}

/// A network interface of this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Interface {
    /// Its name, as in `eth0`.
    pub name: String,
    /// Its IPv4 addresses.
    pub addresses: Vec<IpAddr>,
}

impl Network {
    /// Reads `settings`, the variables that `variable` returns and the interfaces of this
    /// machine. Settings come before variables: `ROS_DOMAIN_ID`, `ROS_LOCALHOST_ONLY` and
    /// `ROS_AUTOMATIC_DISCOVERY_RANGE`, as REP 2003 and the documentation of ROS 2 have them.
    ///
    /// # Errors
    /// If a variable has another value than is allowed, or an interface is not there; in words.
    pub fn of(
        settings: &BackendSettings,
        variable: impl Fn(&str) -> Option<String>,
        interfaces: &[Interface],
    ) -> Result<Self, String> {
        let variable = |name: &str| variable(name).filter(|value| !value.trim().is_empty());
        let domain = match (settings.domain, variable("ROS_DOMAIN_ID")) {
            (Some(domain), _) => domain,
            (None, None) => 0,
            (None, Some(text)) => {
                let domain = text.trim().parse().ok().filter(|&domain| domain <= DOMAIN_MAX);
                domain.ok_or_else(|| {
                    format!("ROS_DOMAIN_ID is {text:?}; allowed are 0 to {DOMAIN_MAX}")
                })?
            }
        };
        if !settings.interfaces.is_empty() {
            let named = settings.interfaces.iter().map(|wanted| find(wanted, interfaces));
            let addresses: Vec<_> = named.collect::<Result<_, _>>()?;
            return Ok(Self { domain, addresses: Some(addresses.concat()) });
        }
        let local_only = match variable("ROS_LOCALHOST_ONLY").as_deref().map(str::trim) {
            None | Some("0") => false,
            Some("1") => true,
            Some(other) => {
                return Err(format!("ROS_LOCALHOST_ONLY is {other:?}; allowed are 0, 1"));
            }
        };
        let range =
            variable("ROS_AUTOMATIC_DISCOVERY_RANGE").map(|text| text.trim().to_uppercase());
        let is_local = match range.as_deref() {
            None | Some("SUBNET" | "SYSTEM_DEFAULT") => local_only,
            Some("LOCALHOST") => true,
            // Without discovery no peer is found, and peers cannot be listed.
            other => {
                let other = other.unwrap_or_default();
                return Err(format!(
                    "ROS_AUTOMATIC_DISCOVERY_RANGE is {other:?}; allowed are LOCALHOST, SUBNET, \
                     SYSTEM_DEFAULT; or name interfaces in backend.interfaces"
                ));
            }
        };
        Ok(Self { domain, addresses: is_local.then(|| vec![Ipv4Addr::LOCALHOST.into()]) })
    }
}

/// Addresses of the interface with this name or address.
fn find(wanted: &str, interfaces: &[Interface]) -> Result<Vec<IpAddr>, String> {
    let address: Option<IpAddr> = wanted.parse().ok();
    let is_it = |one: &&Interface| {
        one.name == wanted || address.is_some_and(|address| one.addresses.contains(&address))
    };
    let found = interfaces.iter().find(is_it).filter(|one| !one.addresses.is_empty());
    match (found, address) {
        (Some(_), Some(address)) => Ok(vec![address]),
        (Some(one), None) => Ok(one.addresses.clone()),
        (None, _) => {
            let with_address = interfaces.iter().filter(|one| !one.addresses.is_empty());
            let known: Vec<&str> = with_address.map(|one| one.name.as_str()).collect();
            Err(format!(
                "backend.interfaces names {wanted:?}, which has no IPv4 address here; allowed are {}",
                known.join(", ")
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn machine() -> Vec<Interface> {
        let interface = |name: &str, addresses: &[[u8; 4]]| Interface {
            name: name.into(),
            addresses: addresses.iter().map(|&address| IpAddr::from(address)).collect(),
        };
        vec![
            interface("lo", &[[127, 0, 0, 1]]),
            interface("eth0", &[[10, 0, 0, 2], [10, 0, 0, 3]]),
            interface("eth1", &[]),
        ]
    }

    fn network(settings: &str, variables: &[(&str, &str)]) -> Result<Network, String> {
        let settings: BackendSettings = toml::from_str(settings).unwrap();
        let variable = |name: &str| {
            let found = variables.iter().find(|(other, _)| *other == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        Network::of(&settings, variable, &machine())
    }

    #[test]
    fn the_environment_of_ros_is_honoured_where_settings_say_nothing() {
        let all = |domain| Ok(Network { domain, addresses: None });
        let local = Some(vec![IpAddr::from([127, 0, 0, 1])]);
        assert_eq!(network("", &[]), all(0));
        assert_eq!(network("", &[("ROS_DOMAIN_ID", "7")]), all(7));
        assert_eq!(network("domain = 0", &[("ROS_DOMAIN_ID", "7")]), all(0));
        for variables in
            [[("ROS_LOCALHOST_ONLY", "1")], [("ROS_AUTOMATIC_DISCOVERY_RANGE", "localhost")]]
        {
            assert_eq!(network("", &variables).unwrap().addresses, local, "{variables:?}");
            let named = network("interfaces = [\"eth0\"]", &variables).unwrap().addresses;
            assert_eq!(named.unwrap().len(), 2);
        }
        let variables = [("ROS_LOCALHOST_ONLY", "0"), ("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")];
        assert_eq!(network("", &variables), all(0));
        let one = network("interfaces = [\"10.0.0.3\"]", &[]).unwrap().addresses;
        assert_eq!(one, Some(vec![IpAddr::from([10, 0, 0, 3])]));
    }

    #[test]
    fn what_is_not_allowed_is_named_with_its_value() {
        let cases = [
            ("", ("ROS_DOMAIN_ID", "233"), "ROS_DOMAIN_ID is \"233\""),
            ("", ("ROS_DOMAIN_ID", "lab"), "allowed are 0 to 232"),
            ("", ("ROS_LOCALHOST_ONLY", "yes"), "ROS_LOCALHOST_ONLY is \"yes\""),
            ("", ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"), "is \"OFF\""),
            ("interfaces = [\"wlan0\"]", ("A", "b"), "names \"wlan0\""),
            ("interfaces = [\"eth1\"]", ("A", "b"), "allowed are lo, eth0"),
            ("interfaces = [\"10.0.0.9\"]", ("A", "b"), "10.0.0.9"),
        ];
        for (settings, variable, says) in cases {
            let error = network(settings, &[variable]).unwrap_err();
            assert!(error.contains(says), "{error}: {says}");
        }
    }
}
