-- expect: 7: undefined global "ampltude"; did you mean "amplitude"?
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
local amplitude = 2
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = s.t + ampltude }
  end }
