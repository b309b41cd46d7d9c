-- set: k=0
-- expect: 6: links[1].axis: length 0; must be a direction
local rd = require "refdyn"
local p = rd.parameters { { "k", 1 } }
return rd.model { name = "wrong", links = {
  { "a", joint = "psi", axis = { 0, p.k, p.k }, mass = 1, inertia = { yy = 1 } } } }
