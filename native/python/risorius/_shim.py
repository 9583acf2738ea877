
import numpy as np
class JointChain:
    def __init__(self, parents, rest):
        self.p=np.asarray(parents); rest=np.asarray(rest,np.float64); self.n=len(self.p)
        self.inv=np.linalg.inv(rest); self.loc=np.empty_like(rest)
        self.order=[]; done=set()
        def visit(i):
            if i in done: return
            if self.p[i]>=0: visit(int(self.p[i]))
            done.add(i); self.order.append(i)
        for i in range(self.n): visit(i)
        for i in range(self.n):
            self.loc[i]= self.inv[self.p[i]]@rest[i] if self.p[i]>=0 else rest[i]
    def evaluate(self, location, rotation, scale):
        w,x,y,z=np.asarray(rotation,np.float64).T
        m=np.zeros((self.n,4,4)); m[:,3,3]=1
        m[:,0,0]=1-2*(y*y+z*z); m[:,0,1]=2*(x*y-w*z); m[:,0,2]=2*(x*z+w*y)
        m[:,1,0]=2*(x*y+w*z); m[:,1,1]=1-2*(x*x+z*z); m[:,1,2]=2*(y*z-w*x)
        m[:,2,0]=2*(x*z-w*y); m[:,2,1]=2*(y*z+w*x); m[:,2,2]=1-2*(x*x+y*y)
        m[:,:3,:3]*=np.asarray(scale)[:,None,:]; m[:,:3,3]=location
        l=self.loc@m; g=np.empty_like(l)
        for i in self.order:
            p=self.p[i]; g[i]=g[p]@l[i] if p>=0 else l[i]
        return (g@self.inv)[:,:3].astype(np.float32)
class Skin:
    def __init__(self, count, offsets, bones, weights, bone_count):
        own=np.repeat(np.arange(count),np.diff(offsets.astype(np.int64)))
        self.own,self.b,self.w,self.n=own,bones.astype(np.int64),weights.astype(np.float64),count
        s=np.bincount(own,self.w,count); self.bare=s<=1e-4; self.w=self.w/np.where(self.bare,1,s)[own]
    def evaluate(self, points, matrices, out=None):
        mm=(matrices.reshape(-1,12)[self.b]*self.w[:,None])
        r=np.zeros((self.n,12)); 
        for k in range(12): r[:,k]=np.bincount(self.own,mm[:,k],self.n)
        r=r.reshape(-1,3,4); p=points.astype(np.float64)
        o=np.einsum('vij,vj->vi',r[:,:,:3],p)+r[:,:,3]
        o[self.bare]=p[self.bare]
        return np.ascontiguousarray(o,np.float32)
