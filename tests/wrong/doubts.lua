-- expect: 13: warning: p.m: `==` compares while the model is read and is always false; use rd.where to choose during the motion
-- expect: 17: warning: state.t: `==` compares while the model is read and is always false; use rd.where to choose during the motion
-- expect: 18: warning: load: a condition while the model is read, always true; use rd.where to choose during the motion
-- expect: 19: warning: q.a_x: `~=` compares while the model is read and is always true; use rd.where to choose during the motion
-- expect: 20: warning: q.a_x: a condition while the model is read, always true; use rd.where to choose during the motion
-- expect: 21: forces.a_y: unknown coordinate; did you mean "a_x"?
local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "kg" } }
local load = rd.input("load", 0, "N")
local kind = rd.option("kind", "a")
return rd.model {
  name = "wrong",
  links = { { "a", joint = { "x" }, mass = p.m == 1 and p.m or 2 } },
  forces = function(state)
    local q = state.q
    local push = 1
    if kind == "a" and state.t == 2 then push = 2 end
    if load then push = 3 end
    if 0 ~= q.a_x then push = 4 end
    if not q.a_x then push = 5 end
    return { a_x = push, a_y = 0 }
  end,
}
