-- expect: 6: parameter double: a reserved word of C or C++, another name is needed
-- expect: 10: link for: a reserved word of C or C++, another name is needed
-- expect: 11: link "2nd": no identifier of C, a letter and then letters, digits and _ are needed
-- expect: 12: link ground: the name of what stands still, another is needed
local rd = require "refdyn"
local p = rd.parameters { { "double", 1 } }
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "for", joint = { "x" }, mass = 1 },
    { "2nd", on = "for", mass = 1 },
    { "ground", on = "for", mass = 1 },
  },
}
