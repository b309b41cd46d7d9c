-- expect: 4: setmetatable: __mode is not allowed in a model
-- Tries to make tables weak, whose clearing takes quadratic time.
local rd = require "refdyn"
for i = 1, 1e5 do setmetatable({}, { __mode = "k" }) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
