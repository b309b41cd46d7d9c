-- expect: 7: undefined global "riseof"; did you mean "rise_of"?
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
function rise_of(t) return t end
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = riseof(s.t) }
  end }
