-- expect: 22: --set a: value "4.5"; must be a whole number
-- expect: 22: --set b: value "1e300"; must be a whole number
-- expect: 22: --set c: value " 4"; must be a whole number
-- expect: 23: --set d: value "0x10"; must be a number
-- expect: 23: --set e: value "inf"; must be a number
-- expect: 23: --set f: value ""; must be a number
-- expect: 23: --set g: value "1e400"; must be a number
-- expect: 24: --set h: value "2,5"; must be a number; write 2.5
-- expect: 24: --set i: value "nan"; must be a number
-- expect: 24: --set k: value "yes"; must be true or false
-- set: a=4.5
-- set: b=1e300
-- set: c= 4
-- set: d=0x10
-- set: e=inf
-- set: f=
-- set: g=1e400
-- set: h=2,5
-- set: i=nan
-- set: k=yes
local rd = require "refdyn"
for _, name in ipairs { "a", "b", "c" } do rd.option(name, 1) end
local p = rd.parameters { { "d", 1 }, { "e", 1 }, { "f", 1 }, { "g", 1 } }
local h, i, k = rd.input("h", 1), rd.input("i", 1), rd.option("k", true)
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
}
