-- expect: 6: forces[1]: against names the link on which the torque acts; name another link
local rd = require "refdyn"
return rd.model { name = "wrong", links = {
    { "a", joint = "psi", mass = 1, inertia = { zz = 1 } } },
  forces = function()
    return { rd.torque { "a", { 0, 0, 1 }, against = "a" } }
  end }
