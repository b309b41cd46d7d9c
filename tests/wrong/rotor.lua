-- expect: 13: links[1].rotor.theta: the link has no such joint; use psi
-- expect: 14: links[2].rotor.psi: a number; must be { inertia = 1e-4, gear = 100 }
-- expect: 15: links[3].rotor.psi.inertia: missing; a rotor needs it
-- expect: 16: links[4].rotor.psi.inertia: value -1; must not be negative
-- expect: 17: links[5].rotor.psi.geer: unknown field; did you mean "gear"?
-- expect: 18: links[6].rotor: a number; must be a table by joint such as { psi = { inertia = 1e-4, gear = 100 } }
-- expect: 19: links[7].rotor: has entries without a name; must be a table by joint such as { psi = { inertia = 1e-4, gear = 100 } }
-- expect: 20: links[8].rotor.psi: the link has no such joint; there are none
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
