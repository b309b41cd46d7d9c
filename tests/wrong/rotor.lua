-- expect: 13: links[1].rotor.theta: the link has no such joint, it has psi
-- expect: 14: links[2].rotor.psi: a number, { inertia = 1e-4, gear = 100 } is needed
-- expect: 15: links[3].rotor.psi.inertia: missing, a rotor needs it
-- expect: 16: links[4].rotor.psi.inertia: value -1, a number not below 0 is needed
-- expect: 17: links[5].rotor.psi.geer: unknown field, the nearest known one is "gear"
-- expect: 18: links[6].rotor: a number, a table by joint such as { psi = { inertia = 1e-4, gear = 100 } } is needed
-- expect: 19: links[7].rotor: has entries without a name, a table by joint such as { psi = { inertia = 1e-4, gear = 100 } } is needed
-- expect: 20: links[8].rotor.psi: the link has no such joint, it has none
local rd = require "refdyn"
return rd.model {
  name = "wrong",
  links = {
    { "other", joint = "psi", mass = 1, inertia = { zz = 1 }, rotor = { theta = { inertia = 1 } } },
    { "number", joint = "psi", mass = 1, inertia = { zz = 1 }, rotor = { psi = 1 } },
    { "lacks", joint = "psi", mass = 1, inertia = { zz = 1 }, rotor = { psi = { gear = 100 } } },
    { "below", joint = "psi", mass = 1, inertia = { zz = 1 }, rotor = { psi = { inertia = -1 } } },
    { "misspelt", joint = "psi", mass = 1, inertia = { zz = 1 }, rotor = { psi = { inertia = 1, geer = 2 } } },
    { "plain", joint = "psi", mass = 1, inertia = { zz = 1 }, rotor = 1 },
    { "listed", joint = "psi", mass = 1, inertia = { zz = 1 }, rotor = { { inertia = 1 } } },
    { "weld", mass = 1, rotor = { psi = { inertia = 1 } } },
  },
}
