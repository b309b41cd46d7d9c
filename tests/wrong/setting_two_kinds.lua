-- expect: 4: --set n: the model has this name as option and as parameter; rename one of them
-- set: n=2
local rd = require "refdyn"
local n, p = rd.option("n", 1), rd.parameters { { "n", 2 } }
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "z", mass = p.n },
  },
}
