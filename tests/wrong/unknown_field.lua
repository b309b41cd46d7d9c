-- expect: 6: links[1].mas: unknown field; did you mean "mass"?
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mas = 1 },
  },
}
