-- expect: 14: links[1].limits.theta: the link has no such joint; use psi
-- expect: 15: links[2].limits.psi: from 2 to 2; the range must ascend
-- expect: 16: links[3].limits.psi: empty; write { from = -2, to = 2, rate = 3, force = 100 }
-- expect: 17: links[4].limits.psi.rate: value 0; must be positive
-- expect: 18: links[5].limits.psi.force: value -3; must be positive
-- expect: 19: links[6].limits.psi.to: an expression; must be a number
-- expect: 20: links[7].limits.psi.until: unknown field; use one of from, to, rate, force
-- expect: 21: links[8].limits.psi: a number; must be { from = -2, to = 2, rate = 3, force = 100 }
local rd = require "refdyn"
local p = rd.parameters { { "most", 2, "rad" } }
return rd.model {
  name = "wrong",
  links = {
    { "other", joint = "psi", mass = 1, inertia = { zz = 1 }, limits = { theta = { from = 1 } } },
    { "range", joint = "psi", mass = 1, inertia = { zz = 1 }, limits = { psi = { from = 2, to = 2 } } },
    { "none", joint = "psi", mass = 1, inertia = { zz = 1 }, limits = { psi = {} } },
    { "rate", joint = "psi", mass = 1, inertia = { zz = 1 }, limits = { psi = { rate = 0 } } },
    { "force", joint = "psi", mass = 1, inertia = { zz = 1 }, limits = { psi = { force = -3 } } },
    { "symbol", joint = "psi", mass = 1, inertia = { zz = 1 }, limits = { psi = { to = p.most } } },
    { "field", joint = "psi", mass = 1, inertia = { zz = 1 }, limits = { psi = { ["until"] = 2 } } },
    { "number", joint = "psi", mass = 1, inertia = { zz = 1 }, limits = { psi = 2 } },
  },
}
