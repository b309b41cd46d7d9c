-- expect: 4: more than 1000000 values in the model
local rd = require "refdyn"
local t = {}
for i = 1, 25 do t = { t, t } end
return rd.model { name = "wrong", links = t }
