-- expect: 14: links[1].limits.theta: the link has no such joint, it has psi
-- expect: 15: links[2].limits.psi: from 2 to 2, a range that ascends is needed
-- expect: 16: links[3].limits.psi: empty, { from = -2, to = 2, rate = 3, force = 100 } is needed
-- expect: 17: links[4].limits.psi.rate: value 0, a positive number is needed
-- expect: 18: links[5].limits.psi.force: value -3, a positive number is needed
-- expect: 19: links[6].limits.psi.to: an expression, a number is needed
-- expect: 20: links[7].limits.psi.until: unknown field, known: from to rate force
-- expect: 21: links[8].limits.psi: a number, { from = -2, to = 2, rate = 3, force = 100 } is needed
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
